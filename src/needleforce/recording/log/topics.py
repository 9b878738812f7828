# SPDX-License-Identifier: Apache-2.0
"""Collection of the messages of all topics with force, depth or marks, and the choice of one topic for each."""

import json
import math
import struct
from array import array
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ...files import MAX_SAMPLES
from ..recording import Note
from . import ros_messages
from .messages import Mark, Messages, in_sequence
from .ros_messages import joints_of, position_of, string_of, wrench_of
from .writer import AXIS_TOPIC, MARKS_TOPIC, STANDING, WRENCH_TOPIC

_WRENCHES = (ros_messages.WRENCH_STAMPED, ros_messages.WRENCH)
_STATES = {ros_messages.JOINT_STATE: joints_of, ros_messages.POSE_STAMPED: position_of}
_MAX_OTHERS = 100  # topics that are not read and are named
_MAX_JOINTS = 32  # joints of one topic that are read
_MAX_MARK_BYTES = 1 << 16  # of one mark; those of this package have about 100
_MAX_MARKS_BYTES = 1 << 25  # of all: a fault status of each sample for some minutes
_OVERLAP_NS = 500_000_000  # of blocks: messages of two devices arrive less out of order than this
_MIN_JOINT_SHARE = 0.01  # of a topic's messages: a rarer joint name is a damaged message
TYPES = {*_WRENCHES, *_STATES}
"""The messages that are used."""
TOO_LONG = "Reduce it while it is read, with --decimate-to-hz 100, or read it by its parts."
AS_TABLE = "Save the topic as CSV, with rostopic echo -p or ros2 topic echo --csv while the bag is played."
_TYPES_OF = {"force": _WRENCHES, "depth": tuple(_STATES)}


def _split(text: str) -> tuple[str, str]:
    """Split a choice into topic and part, either may be empty: ``/ft/wrench:fx``, ``/ft/wrench``, ``fx``,
    ``needle_joint``."""
    topic, _, part = text.partition(":") if text.startswith("/") else ("", "", text)
    return topic, part


class Collected:
    """The messages by topic; ``columns`` may name the topic of force and depth, and the joint of depth."""

    def __init__(self, columns: Mapping[str, str], place: str):
        self._place = place
        self._force_topic, self.axial = _split(columns.get("force", ""))
        self._depth_topic, self._joint = _split(columns.get("depth", ""))
        self._topics: dict[str, _Topic] = {}
        self.marks: list[Mark] = []
        self.count = 0  # messages since the last cut
        self._undecoded = self._mark_bytes = 0
        self._others: dict[str, str] = {}
        self._standing: dict[str, Mark] = {}  # the last mark of each kind

    def take(self, topic: str, message: str, counter: int, arrival: int, device: int, data: bytes) -> None:
        """Add one message of the type ``message``; types other than those of force, depth and marks are ignored."""
        self.count += 1
        try:
            if message in _WRENCHES:
                stamp, values = wrench_of(data, message)
                self._of(topic, message).add({"": values}, (counter, arrival, device, stamp))
            elif message in _STATES:
                stamp, joints = _STATES[message](data)
                self._of(topic, message).add(joints, (counter, arrival, device, stamp))
            elif message == ros_messages.STRING and topic == MARKS_TOPIC:
                self._mark(arrival, data)
            else:
                self.leave_out(topic, message)
        except InputError:
            raise
        except (ValueError, struct.error, AttributeError, TypeError, KeyError, RecursionError):
            self._undecoded += 1

    def leave_out(self, topic: str, message: str) -> None:
        """Remember a topic whose messages of this type are not read."""
        if len(self._others) < _MAX_OTHERS:
            self._others[topic] = message

    def others(self) -> tuple[str, ...]:
        """The topics that are not read, each with its type."""
        return tuple(f"{topic} ({message})" for topic, message in sorted(self._others.items()))

    def _mark(self, arrival: int, data: bytes) -> None:
        self._mark_bytes += len(data)
        if self._mark_bytes > _MAX_MARKS_BYTES:
            value, limit = f"over {_MAX_MARKS_BYTES} bytes", "more than any recording has"
            raise InputError("size of the marks", value, limit, self._place, "Record again, in several files.")
        if len(data) > _MAX_MARK_BYTES:
            raise ValueError("a mark of this size is damaged")
        facts = json.loads(string_of(data))
        mark = Mark(arrival, str(facts.pop("kind")), facts)
        # each part of a recording repeats those that hold
        if mark.kind not in STANDING or mark != self._standing.get(mark.kind):
            self._standing[mark.kind] = mark
            self.marks.append(mark)

    def cut(self) -> "Collected":
        """Take out what was collected up to half a second before the last message that force and depth both have. What
        came later remains here, with some of the motion before, between which depth is interpolated, and the bias."""
        used = [
            self._topic(*each)
            for each in (("force", self._force_topic, WRENCH_TOPIC), ("depth", self._depth_topic, AXIS_TOPIC))
        ]
        last = [joint.arrivals().max() for topic in used if topic for joint in self._topics[topic].joints.values()]
        end = min(last, default=0) - _OVERLAP_NS
        if force := used[0]:  # of a motion that ended there is no more
            arrivals = self._topics[force].joints[""].arrivals()
            end = end if 2 * np.count_nonzero(arrivals <= end) > len(arrivals) else int(arrivals.max())
        taken = copy(self)
        taken._topics, later = {}, {}
        for name, topic in self._topics.items():
            since = end if topic.message in _WRENCHES else end - 2 * _OVERLAP_NS
            until = end if topic.message in _WRENCHES else math.inf
            taken._topics[name] = topic.kept(lambda arrival, until=until: arrival <= until)
            later[name] = topic.kept(lambda arrival, since=since: arrival > since)
        bias = [each for each in self.marks if each.kind == "bias" and each.arrival <= end][-1:]
        self._topics, self.count, self._mark_bytes = later, 0, 0
        self.marks = bias + [each for each in self.marks if each.arrival > end - _OVERLAP_NS and each not in bias]
        return taken

    def clear(self) -> None:
        """Leave the messages to what was made of them."""
        self._topics = {}

    def wrench(self) -> Messages:
        """The messages of the only topic with wrenches, or of the chosen one."""
        topic = self._topic("force", self._force_topic, WRENCH_TOPIC)
        return self._topics[topic].joints[""].messages(topic, 6) if topic else _Joint().messages("", 6)

    def axis(self) -> Messages:
        """The messages of the only topic with joints or poses, or of the chosen one; InputError for an ambiguous
        joint."""
        topic = self._topic("depth", self._depth_topic, AXIS_TOPIC)
        return self._one_joint(topic).messages(topic, 2) if topic else _Joint().messages("", 2)

    def notes(self) -> list[Note]:
        """A note on messages that could not be decoded."""
        message = f"{self._undecoded} messages cannot be decoded and are left out"
        return [Note("damaged", message, self._undecoded)] if self._undecoded else []

    def _of(self, topic: str, message: str) -> "_Topic":
        found = self._topics.setdefault(topic, _Topic(message, {}))
        if found.message != message:
            raise ValueError("two types on one topic")
        return found

    def _topic(self, quantity: str, chosen: str, standard: str) -> str:
        topics = sorted(
            name for name, each in self._topics.items() if each.joints and each.message in _TYPES_OF[quantity]
        )
        if chosen and chosen not in topics:
            of_type = " or ".join(each.rpartition("/")[2] for each in _TYPES_OF[quantity])
            limit = f"of the type {of_type} there is {', '.join(topics) or 'none'}"
            advice = f"Give one of them with --column {quantity}=TOPIC." if topics else AS_TABLE
            raise InputError(f"topic of {quantity}", repr(chosen), limit, self._place, advice)
        if not chosen and len(topics) > 1 and standard not in topics:
            limit = f"available: {', '.join(topics)}"
            advice = f"Choose one, for example with --column {quantity}={topics[0]}."
            raise InputError(f"topic of {quantity}", "ambiguous", limit, self._place, advice)
        return chosen or (standard if standard in topics else next(iter(topics), ""))

    def _one_joint(self, topic: str) -> "_Joint":
        joints = self._topics[topic].joints
        default = "z" if self._topics[topic].message == ros_messages.POSE_STAMPED else ""
        name = self._joint or default
        frequent = [each for each in joints if len(joints[each]) > _MIN_JOINT_SHARE * max(map(len, joints.values()))]
        if not name and len(frequent) == 1:
            name = frequent[0]
        if name not in joints:
            limit, chosen = f"available: {', '.join(sorted(frequent))}", repr(name) if name else "not named"
            advice = f"Choose one, for example with --column depth={topic}:{min(frequent)}."
            raise InputError(f"joint in {topic}", chosen, limit, self._place, advice)
        return joints[name]


@dataclass
class _Topic:
    """The messages of one topic by joint; a wrench is a joint without a name."""

    message: str
    joints: dict[str, "_Joint"]

    def kept(self, chosen: Callable[[np.ndarray], np.ndarray]) -> "_Topic":
        """Only the messages of which the time of arrival is chosen."""
        return _Topic(self.message, {name: each.kept(chosen(each.arrivals())) for name, each in self.joints.items()})

    def add(self, joints: Mapping[str, tuple[float, ...]], times: tuple[int, ...]) -> None:
        """Add the counter and times of one message, and the values of each of its joints."""
        if max(times) >= 1 << 63:
            raise ValueError("a time beyond the range of int64")
        for name, values in joints.items():
            if name in self.joints or len(self.joints) < _MAX_JOINTS:
                joint = self.joints.setdefault(name, _Joint())
                joint.add(times, values)
                if len(joint) > MAX_SAMPLES:
                    limit = f"at most {MAX_SAMPLES} are read: nine hours at 1 kHz"
                    raise InputError("number of messages", f"over {MAX_SAMPLES}", limit, next_step=TOO_LONG)


class _Joint:
    """Counters, times and values of one joint in compact arrays of 8 bytes per entry."""

    def __init__(self):
        self._times, self._values = array("q"), array("d")

    def __len__(self) -> int:
        return len(self._times) // 4

    def add(self, times: tuple[int, ...], values: tuple[float, ...]) -> None:
        self._times.extend(times)
        self._values.extend(values)

    def arrivals(self) -> np.ndarray:
        """The times of arrival (n,) [ns]."""
        return np.array(self._times).reshape(-1, 4)[:, 1]

    def kept(self, mask: np.ndarray) -> "_Joint":
        """The messages where ``mask`` (n,) is True."""
        kept = _Joint()
        for mine, its in ((self._times, kept._times), (self._values, kept._values)):
            its.frombytes(np.array(mine).reshape(len(mask), -1)[mask].tobytes())
        return kept

    def messages(self, topic: str, width: int) -> Messages:
        counters, *times = np.frombuffer(self._times, np.int64).reshape(-1, 4).T
        return in_sequence(counters, [*times, np.frombuffer(self._values).reshape(-1, width)], topic)
