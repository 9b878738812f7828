# SPDX-License-Identifier: Apache-2.0
"""Tables made from a table: some columns, some rows, a time put together; and why a column has its role."""

from pathlib import Path

import numpy as np
import pytest

from needleforce import InputError
from needleforce.recording.roles import assign_columns
from needleforce.recording.table import Table, TimeStamp

COLUMNS = [np.arange(6.0), np.array([0.0, 5e8, 0.0, 5e8, 0.0, 5e8]), 10.0 + np.arange(6.0), np.full(6, 7.0)]
TABLE = Table(path=Path("x.h5"), headers=["s", "nanosec", "Force [N]", "Load (V)"], units=["", "ns", "", ""],
              name="run", read_column=lambda k: COLUMNS[k], first_row=4)  # fmt: skip


def test_some_rows_of_some_columns():
    part = TABLE.only_columns(2, 4)
    assert (part.headers, part.units) == (["Force [N]", "Load (V)"], ["", ""])
    subset = part.only_rows(np.array([5, 3, 1]))
    assert subset.numbers(0).tolist() == [15.0, 13.0, 11.0] and subset.place(1) == "x.h5, run, row 7"
    run = subset.only_rows(slice(1, None))
    assert run.numbers(0).tolist() == [13.0, 11.0] and run.texts(1) == ["7", "7"]
    with pytest.raises(InputError, match="for a recording within a table"):
        run.from_row(6)


def test_rows_from_one_on():
    assert TABLE.from_row(6).numbers(0).tolist() == [2.0, 3.0, 4.0, 5.0]
    assert TABLE.from_row(6).only_columns(2, 4).place(0) == "x.h5, run, row 6"


def test_a_time_that_is_put_together_and_continued():
    stamped = Table(path=Path("x"), headers=["stamp", "rest"], read_column=lambda k: COLUMNS[k],
                    stamp=TimeStamp(0, 1, 1e9))  # fmt: skip
    assert stamped.numbers(0).tolist() == [0.0, 1.5, 2.0, 3.5, 4.0, 5.5]
    again = Table(path=Path("x"), headers=["time"], read_column=lambda k: np.array([0.0, 1.0, 2.0, 0.0, 1.0, 2.0]))
    continued = again.continue_time(0, (3,))
    assert continued.numbers(0).tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    assert [note.kind for note in continued.notes] == ["phases"] and again.notes == []


def test_each_column_has_its_role_for_a_reason():
    headers = ["Time", "Load 2", "Load 2 (V)", "z", "Position cell 5 kN [mm]"]
    roles = assign_columns(Table(path=Path("x"), headers=headers), {"velocity": "4"})
    found = {quantity: (column.index, column.reason) for quantity, column in roles.columns.items()}
    assert found == {"velocity": (3, "given"), "time": (0, "name"), "depth": (4, "word")}
    assert roles.matches["force"] == [1, 2] and roles.faults["force"].value == "ambiguous"
    assert assign_columns(Table(path=Path("x"), headers=["a [N]", "b [mm]"]), {}).by_unit(["force"])["force"].index == 0
