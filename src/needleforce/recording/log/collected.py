# SPDX-License-Identifier: Apache-2.0
"""The messages of all topics that may hold force, depth or marks, as they come; then one topic of each is chosen."""

import json
import struct
from array import array
from collections.abc import Mapping

import numpy as np

from ...errors import InputError
from ..recording import Note
from . import schemas
from .decoding import joints_of, place_of, string_of, wrench_of
from .messages import Mark, Messages, in_sequence
from .writer import AXIS_TOPIC, MARKS_TOPIC, WRENCH_TOPIC

_WRENCHES = (schemas.WRENCH_STAMPED, schemas.WRENCH)
_STATES = {schemas.JOINT_STATE: joints_of, schemas.POSE_STAMPED: place_of}
_NAMES = 32  # joints told by an error
_QUANTITY = {"force": _WRENCHES, "depth": tuple(_STATES)}


def split_choice(text: str) -> tuple[str, str]:
    """Topic and what of it, either empty: ``/ft/wrench:fx``, ``/ft/wrench``, ``fx``, ``needle_joint``."""
    topic, _, part = text.partition(":") if text.startswith("/") else ("", "", text)
    return topic, part


class Collected:
    """``columns`` may name the topic of force and depth, and the joint of depth."""

    def __init__(self, columns: Mapping[str, str], place: str):
        self._place, self._columns = place, columns
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
                self._of(topic, message).add(counter, arrival, device, stamp, values)
            elif message in _STATES:
                self._state(topic, message, counter, arrival, device, data)
            elif message == schemas.STRING and topic == MARKS_TOPIC:
                facts = json.loads(string_of(data))
                self.marks.append(Mark(arrival, str(facts.pop("kind")), facts))
        except (ValueError, struct.error, OverflowError, AttributeError, TypeError, KeyError, RecursionError):
            self._undecoded += 1

    def wrench(self) -> Messages:
        """Of the one topic of wrenches, or that asked for."""
        return self._chosen("force", self._force_topic, WRENCH_TOPIC)

    def axis(self) -> Messages:
        """Of the one topic of joints or poses, or that asked for; InputError where the joint is to be named."""
        found = self._chosen("depth", self._depth_topic, AXIS_TOPIC)
        names = sorted(self._topics[found.topic].names) if found.topic else []
        if found.topic and not len(found):
            limit = f"it has {', '.join(names)}"
            asked = repr(self._joint) if self._joint else "not named"
            advice = f"Give one, as --column depth={found.topic}:{names[0]}."
            raise InputError(f"joint in {found.topic}", asked, limit, self._place, advice)
        return found

    def notes(self) -> list[Note]:
        """What came and could not be used."""
        what = f"{self._undecoded} messages do not decode: left out"
        return [Note("damaged", what, self._undecoded)] if self._undecoded else []

    def _of(self, topic: str, message: str) -> "_Topic":
        store = self._topics.setdefault(topic, _Topic(message))
        if store.message != message:
            raise ValueError("two types on one topic")
        return store

    def _state(self, topic, message, counter, arrival, device, data) -> None:
        stamp, joints = _STATES[message](data)
        store = self._of(topic, message)
        store.names.update(list(joints)[: _NAMES - len(store.names)])
        usual = "z" if message == schemas.POSE_STAMPED else next(iter(joints), "")
        name = self._joint or (usual if len(joints) == 1 or message == schemas.POSE_STAMPED else "")
        if name in joints and (self._joint or len(store.names) == 1 or usual == "z"):
            store.add(counter, arrival, device, stamp, joints[name])

    def _chosen(self, quantity: str, asked: str, ours: str) -> Messages:
        topics = [topic for topic, store in self._topics.items() if store.message in _QUANTITY[quantity]]
        if asked and asked not in topics:
            limit = f"there are {', '.join(sorted(topics)) or 'none'}"
            raise InputError(f"topic of {quantity}", repr(asked), limit, self._place)
        if not asked and len(topics) > 1 and ours not in topics:
            limit, advice = f"there are {', '.join(sorted(topics))}", f"Give --column {quantity}={sorted(topics)[0]}."
            raise InputError(f"topic of {quantity}", "ambiguous", limit, self._place, advice)
        chosen = asked or (ours if ours in topics else topics[0] if topics else "")
        return (self._topics[chosen] if chosen else _Topic("")).messages(chosen, 6 if quantity == "force" else 2)


class _Topic:
    """The messages of one topic; numbers only, 8 bytes each."""

    def __init__(self, message: str):
        self.message, self.names = message, set()
        self._counters, self._arrival, self._device, self._stamp = (array("q") for _ in range(4))
        self._values = array("d")

    def add(self, counter: int, arrival: int, device: int, stamp: int, values: tuple[float, ...]) -> None:
        if max(arrival, device) >= 1 << 63:
            raise ValueError("a time beyond all clocks")
        for kept, value in zip((self._counters, self._arrival, self._device, self._stamp),
                               (counter, arrival, device, stamp)):  # fmt: skip
            kept.append(value)
        self._values.extend(values)

    def messages(self, topic: str, width: int) -> Messages:
        columns = (np.array(each) for each in (self._arrival, self._device, self._stamp))
        values = np.array(self._values).reshape(-1, width)
        return in_sequence(np.array(self._counters), [*columns, values], topic)
