# SPDX-License-Identifier: Apache-2.0
"""A campaign as one tidy table: a row for each recording and quantity, and for each condition and quantity."""

import os
from collections.abc import Iterator
from pathlib import Path

from ..files import atomic_write
from ..identification.estimates import Estimate
from ..recording.parquet_table import pyarrow_for
from .field_names import COLUMNS
from .result import Campaign, Condition, Outcome


def tidy(campaign: Campaign):
    """A pandas DataFrame in SI: the fields of the conditions, then ``COLUMNS``; pooled values have no ``file``.

    Each recording has a row ``oddities`` with their number, which also says why it gave nothing; its own parameters
    are named as in ``Fit.parameters``; what was seen without a model are speed, travel, hold, forces, and events from
    ``event_contact_depth`` to ``event_exit_depth``.
    """
    import pandas

    fields = dict.fromkeys(name for one in campaign.recordings for name in one.fields)
    rows = [row for condition in campaign.conditions for row in _condition(condition)]
    rows += [row for one in campaign.others for row in _recording(one)]
    made = pandas.DataFrame([dict.fromkeys(fields, "") | row for row in rows], columns=[*fields, *COLUMNS])
    numbers = dict.fromkeys(("value", "low", "high"), "float64")
    return made.astype(numbers | dict.fromkeys(("pooled", "identifiable", "outlier"), "bool"))


def save(campaign: Campaign, path: str | os.PathLike) -> None:
    """Writes the table whole: Parquet for a name that ends so, else CSV.

    Raises InputError where it cannot be written, and for Parquet without pyarrow.
    """
    target, made = Path(path), tidy(campaign)
    if target.suffix.lower() == ".parquet":
        _save_parquet(made, target)
        return
    with atomic_write(target) as file:
        made.to_csv(file, index=False, lineterminator="\n")


def check_table(path: str | os.PathLike) -> None:
    """Raises InputError, before any work, for a Parquet file without pyarrow."""
    if Path(path).suffix.lower() == ".parquet":
        pyarrow_for(path)


def _save_parquet(made, target: Path) -> None:
    pyarrow = pyarrow_for(target)
    buffer = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(pyarrow.Table.from_pandas(made, preserve_index=False), buffer)
    with atomic_write(target) as file:
        file.buffer.write(buffer.getvalue())


def _condition(condition: Condition) -> Iterator[dict]:
    shared = condition.fields | {"file": "", "pooled": True, "status": "ok" if condition.model else "no_model"}
    for one in condition.recordings:
        yield from _recording(one)
    count = Estimate("recordings", float(len(condition.pooled)), "1", float("nan"), float("nan"))
    yield shared | _quantity(count, {"recordings": condition.why} if condition.why else {}, flagged=False)
    for estimate in condition.parameters.values():
        yield shared | _quantity(estimate, {}, flagged=False)


def _recording(one: Outcome) -> Iterator[dict]:
    shared = one.fields | {"file": one.file, "pooled": one.pooled, "status": str(one.status)}
    said: dict[str, str] = {}
    for odd in one.oddities:
        said[odd.quantity] = f"{said.get(odd.quantity, '')} {odd.sentence}".strip()
    count = Estimate("oddities", float(len(one.oddities)), "1", float("nan"), float("nan"))
    yield shared | _quantity(count, {"oddities": one.why}, flagged=bool(one.oddities))
    for estimate in (*one.seen.values(), *one.parameters.values()):
        yield shared | _quantity(estimate, said, flagged=estimate.name in said)


def _quantity(estimate: Estimate, said: dict[str, str], flagged: bool) -> dict:
    return {
        "quantity": estimate.name, "value": estimate.value, "low": estimate.low, "high": estimate.high,
        "unit": estimate.unit, "identifiable": estimate.identifiable, "outlier": flagged,
        "why": said.get(estimate.name, ""),
    }  # fmt: skip
