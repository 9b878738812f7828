# SPDX-License-Identifier: Apache-2.0
"""Conditions as bytes, as workers send them and as the state folder keeps them: a result is the same whether it was
computed just now or last week."""

from dataclasses import dataclass, replace
from typing import Any

import msgspec
import numpy as np

from ..files import decode_toml
from ..preset_files.build import as_toml, build
from ..preset_files.schema import PresetFile
from .result import Condition


@dataclass(frozen=True, kw_only=True)
class Plan:
    """What a campaign consists of: the keys of its conditions in their order, the reason for each file without one, and
    its notes; enough to show the conditions that are done while others are not."""

    keys: tuple[str, ...]
    reasons: dict[str, str]
    notes: tuple[str, ...]
    not_recordings: tuple[tuple[str, str], ...]


def encoded(value: Any) -> bytes:
    """A value of dataclasses, arrays and numbers."""
    return msgspec.msgpack.encode(value, enc_hook=_plain)


def decoded(content: bytes, kind: Any) -> Any:
    """The value that ``encoded`` wrote. Raises ValueError for another."""
    return msgspec.msgpack.decode(content, type=kind, dec_hook=_made)


def encoded_condition(condition: Condition) -> bytes:
    """A condition; its model is kept as the text of a preset file."""
    model = "" if condition.model is None else as_toml(condition.model)
    return encoded((replace(condition, model=None), model))


def decoded_condition(content: bytes) -> Condition:
    """The condition. Raises ValueError for another content."""
    condition, model = decoded(content, tuple[Condition, str])
    return replace(condition, model=build(decode_toml(model.encode(), "model", PresetFile))) if model else condition


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.tobytes()
    if isinstance(value, np.generic):
        return value.item()
    raise NotImplementedError(f"a value of {type(value).__name__}")


def _made(kind: type, value: Any) -> Any:
    if kind is not np.ndarray:
        raise NotImplementedError(f"a value of {kind.__name__}")
    return np.frombuffer(value[1], np.dtype(value[0])).copy()
