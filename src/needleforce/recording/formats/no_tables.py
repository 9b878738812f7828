# SPDX-License-Identifier: Apache-2.0
"""Formats without a table: logs of messages, which ``recording.log`` reads, and what is recognised to say how to export
it."""

from ...files import BAG, MCAP
from . import Format


def _is_nanoscope(start: bytes) -> bool:
    """Whether a file has the head of a NanoScope file, and is not the text that its program exports with this head."""
    return start.startswith((b"\\*Force file list", b"\\*File list")) and b"\0" in start


ROS2_BAG = Format(name="a ROS 2 bag", log=True)  # a folder
ARCHIVE = Format(name="a zip archive", advice="Unpack it, and name the recording in it.")
FORMATS = (
    Format(name="MCAP", suffixes=(".mcap",), starts=(MCAP,), log=True),
    Format(name="a ROS 1 bag", suffixes=(".bag",), starts=(b"#ROSBAG",), log=True),
    Format(
        name="a database",
        suffixes=(".db3",),
        starts=(b"SQLite format 3",),
        advice=f"If it is of a ROS 2 bag, name the bag's folder; without {BAG}, run ros2 bag reindex FOLDER first.",
    ),
    Format(
        name="a NanoScope file (Bruker)",
        suffixes=(".spm",),
        matches=_is_nanoscope,
        advice="In NanoScope Analysis, export the curves as ASCII text.",
    ),
    Format(
        name="a TDM file (National Instruments)",
        suffixes=(".tdm",),
        matches=lambda start: b"<usi:tdm" in start[:4096],
        advice="Save it as TDMS in LabVIEW or DIAdem, or as a workbook with NI's TDM add-in for Excel.",
    ),
)
