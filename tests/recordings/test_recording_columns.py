# SPDX-License-Identifier: Apache-2.0
from pathlib import Path

import numpy as np
import pytest

from needleforce.recording.quantities import AXES, split
from needleforce.recording.roles import assign_columns
from needleforce.recording.table import Table

ALL = ("time", "depth", "velocity", "force", *AXES)


def table_of(headers):
    """A table of some columns whose values are below and above zero."""
    return Table(path=Path("x"), headers=headers.split(","), read_column=lambda _: np.linspace(-1.0, 1.0, 9))


@pytest.mark.parametrize(
    "header, name, unit",
    [
        ("time", "time", None), ("Force [N]", "Force", "N"), ("Depth (mm)", "Depth", "mm"), ("time_us", "time", "us"),
        ("axial_force_N", "axial_force", "N"), ("speed_mm_s", "speed", "mm_s"), ("tx_N_m", "tx", "N_m"),
        ("force / mN", "force", "mN"), ("time in ms", "time", "ms"), ("p_z", "p_z", None),
        ("Time (sec)", "Time", "sec"), ("insertion_depth", "insertion_depth", None), ("pos_m", "pos", "m"),
        ("fx_N", "fx", "N"),
    ],
)  # fmt: skip
def test_a_header_is_a_name_and_a_unit(header, name, unit):
    assert split(header) == (name, unit)


@pytest.mark.parametrize(
    "headers, found",
    [
        (
            "time,fx,fy,fz,tx,ty,tz,px,py,pz",
            {"time": 0, "fx": 1, "fy": 2, "force": 3, "tx": 4, "ty": 5, "tz": 6, "depth": 9},
        ),
        ("Timestamp,Position [mm],Force [N]", {"time": 0, "depth": 1, "force": 2}),
        ("t,displacement_mm,speed_mm_s,axial_force_N,note", {"time": 0, "depth": 1, "velocity": 2, "force": 3}),
        (
            "Time (sec),Force X (N),Force Y (N),Force Z (N),Torque X (Nm)",
            {"time": 0, "fx": 1, "fy": 2, "force": 3, "tx": 4},
        ),
    ],
)
def test_common_headers_are_recognised(headers, found):
    chosen = assign_columns(table_of(headers), {}).chosen(ALL)
    assert {quantity: column.index for quantity, column in chosen.items()} == found


def test_given_headers_override_recognised_ones():
    chosen = assign_columns(table_of("time,fz,load,pz"), {"force": "load"}).chosen(ALL)
    assert chosen["force"].index == 2


def test_a_header_can_be_given_without_its_unit():
    headers = Table(path=Path("x"), headers=["time", "tip position [um]"])
    assert assign_columns(headers, {"depth": "Tip position"}).columns["depth"].unit == "um"
