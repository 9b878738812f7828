# SPDX-License-Identifier: Apache-2.0
"""The folder of a ROS 2 bag, by the package rosbags."""

from collections.abc import Callable
from pathlib import Path

from ...errors import InputError
from ..formats import BAG


def read_bag(folder: Path, take: Callable[[str, str, int, int, int, bytes], None]) -> None:
    """Hand all messages to ``take`` (topic, type, counter, arrival [ns], device [ns], CDR); a bag has no counters.

    Raises InputError where the folder is no bag, or rosbags is not there.
    """
    if not (folder / BAG).is_file():
        limit = f"a ROS 2 bag has a {BAG}"
        raise InputError("folder", "no ROS 2 bag", limit, str(folder), "Name a file, or the folder of a bag.")
    try:
        from rosbags.rosbag2 import Reader
    except ImportError:
        advice = 'Install the extra "ros": pip install "needleforce[ros]".'
        raise InputError("package rosbags", "missing", "it reads ROS 2 bags", str(folder), advice) from None
    try:
        with Reader(folder) as reader:
            for connection, arrival, data in reader.messages():
                take(connection.topic, connection.msgtype, 0, arrival, arrival, bytes(data))
    except InputError:
        raise
    except Exception as error:  # whatever the package meets in a damaged bag
        why = " ".join(str(error).split())[:200]
        raise InputError("bag", "not readable", why, str(folder), "Check that it is whole.") from None
