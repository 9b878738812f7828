# SPDX-License-Identifier: Apache-2.0
"""The messages of all topics that may hold force, depth or marks, as they come; then one topic of each is chosen."""

import json
import struct
from array import array
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...errors import InputError
from ..recording import Note
from . import ros_messages
from .messages import Mark, Messages, in_sequence
from .ros_messages import joints_of, place_of, string_of, wrench_of
from .writer import AXIS_TOPIC, MARKS_TOPIC, WRENCH_TOPIC

_WRENCHES = (ros_messages.WRENCH_STAMPED, ros_messages.WRENCH)
_STATES = {ros_messages.JOINT_STATE: joints_of, ros_messages.POSE_STAMPED: place_of}
_JOINTS = 32  # of one topic, and no more
_STRAY = 0.01  # share of a topic's messages: a name that is rarer is damage
_OF = {"force": _WRENCHES, "depth": tuple(_STATES)}


def split_choice(text: str) -> tuple[str, str]:
    """Topic and what of it, either empty: ``/ft/wrench:fx``, ``/ft/wrench``, ``fx``, ``needle_joint``."""
    topic, _, part = text.partition(":") if text.startswith("/") else ("", "", text)
    return topic, part


class Collected:
    """``columns`` may name the topic of force and depth, and the joint of depth."""

    def __init__(self, columns: Mapping[str, str], place: str):
        self._place = place
        self._force_topic = split_choice(columns.get("force", ""))[0]
        self._depth_topic, self._joint = split_choice(columns.get("depth", ""))
        self._topics: dict[str, _Topic] = {}
        self.marks: list[Mark] = []
        self._undecoded = 0

    def take(self, topic: str, message: str, counter: int, arrival: int, device: int, data: bytes) -> None:
        """One message of the type ``message``; others than those of force, depth and marks are passed over."""
        try:
            if message in _WRENCHES:
                stamp, values = wrench_of(data, message)
                self._of(topic, message).add({"": values}, (counter, arrival, device, stamp))
            elif message in _STATES:
                stamp, joints = _STATES[message](data)
                self._of(topic, message).add(joints, (counter, arrival, device, stamp))
            elif message == ros_messages.STRING and topic == MARKS_TOPIC:
                facts = json.loads(string_of(data))
                self.marks.append(Mark(arrival, str(facts.pop("kind")), facts))
        except (ValueError, struct.error, AttributeError, TypeError, KeyError, RecursionError):
            self._undecoded += 1

    def wrench(self) -> Messages:
        """Of the one topic of wrenches, or that asked for."""
        topic = self._topic("force", self._force_topic, WRENCH_TOPIC)
        return self._topics[topic].joints[""].messages(topic, 6) if topic else _Joint().messages("", 6)

    def axis(self) -> Messages:
        """Of the one topic of joints or poses, or that asked for; InputError where the joint is to be named."""
        topic = self._topic("depth", self._depth_topic, AXIS_TOPIC)
        return self._one_joint(topic).messages(topic, 2) if topic else _Joint().messages("", 2)

    def notes(self) -> list[Note]:
        """What came and could not be used."""
        what = f"{self._undecoded} messages do not decode: left out"
        return [Note("damaged", what, self._undecoded)] if self._undecoded else []

    def _of(self, topic: str, message: str) -> "_Topic":
        found = self._topics.setdefault(topic, _Topic(message, {}))
        if found.message != message:
            raise ValueError("two types on one topic")
        return found

    def _topic(self, quantity: str, asked: str, ours: str) -> str:
        topics = sorted(name for name, each in self._topics.items() if each.joints and each.message in _OF[quantity])
        if asked and asked not in topics:
            limit = f"there are {', '.join(topics) or 'none'}"
            raise InputError(f"topic of {quantity}", repr(asked), limit, self._place)
        if not asked and len(topics) > 1 and ours not in topics:
            limit, advice = f"there are {', '.join(topics)}", f"Give --column {quantity}={topics[0]}."
            raise InputError(f"topic of {quantity}", "ambiguous", limit, self._place, advice)
        return asked or (ours if ours in topics else next(iter(topics), ""))

    def _one_joint(self, topic: str) -> "_Joint":
        joints = self._topics[topic].joints
        usual = "z" if self._topics[topic].message == ros_messages.POSE_STAMPED else ""
        name = self._joint or usual
        often = [each for each in joints if len(joints[each]) > _STRAY * max(map(len, joints.values()))]
        if not name and len(often) == 1:
            name = often[0]
        if name not in joints:
            limit, asked = f"it has {', '.join(sorted(often))}", repr(name) if name else "not named"
            advice = f"Give one, as --column depth={topic}:{min(often)}."
            raise InputError(f"joint in {topic}", asked, limit, self._place, advice)
        return joints[name]


@dataclass
class _Topic:
    """The messages of one topic, joint by joint; the wrench is one without a name."""

    message: str
    joints: dict[str, "_Joint"]

    def add(self, joints: Mapping[str, tuple[float, ...]], times: tuple[int, ...]) -> None:
        """Counter and times of one message, and the values of each joint in it."""
        if max(times) >= 1 << 63:
            raise ValueError("a time beyond all clocks")
        for name, values in joints.items():
            if name in self.joints or len(self.joints) < _JOINTS:
                self.joints.setdefault(name, _Joint()).add(times, values)


class _Joint:
    """Numbers only, 8 bytes each."""

    def __init__(self):
        self._times, self._values = array("q"), array("d")

    def __len__(self) -> int:
        return len(self._times) // 4

    def add(self, times: tuple[int, ...], values: tuple[float, ...]) -> None:
        self._times.extend(times)
        self._values.extend(values)

    def messages(self, topic: str, width: int) -> Messages:
        counters, *times = np.array(self._times).reshape(-1, 4).T
        return in_sequence(counters, [*times, np.array(self._values).reshape(-1, width)], topic)
