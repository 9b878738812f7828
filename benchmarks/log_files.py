# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - metadata and statements have long lines
"""Valid logs of messages: MCAP, ROS 1 bags, and the folder of a ROS 2 bag, for ``hostile_changes.py``."""

import sqlite3
import tempfile
from functools import cache
from pathlib import Path

import damaged_files
import numpy as np
from hostile_content import DEPTH, FORCE, ROWS

from needleforce.recording.log import ros_messages


def ros1(form: int) -> bytes:
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    vector, wrench = types["geometry_msgs/msg/Vector3"], types["geometry_msgs/msg/Wrench"]
    with tempfile.TemporaryDirectory() as folder:
        writer = Writer(Path(folder) / "x.bag")
        if form % 3:
            writer.set_compression((Writer.CompressionFormat.BZ2, Writer.CompressionFormat.LZ4)[form % 3 - 1])
        with writer:
            names = {"/w": "geometry_msgs/msg/WrenchStamped", "/j": "sensor_msgs/msg/JointState"}
            topics = {topic: writer.add_connection(topic, name, typestore=store) for topic, name in names.items()}
            for number in range(ROWS):
                at = damaged_files.START + number * 10_000_000
                head = types["std_msgs/msg/Header"](
                    number, types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9), "f"
                )
                force = types[names["/w"]](head, wrench(vector(0.0, 0.0, FORCE[number]), vector(0.0, 0.0, 0.0)))
                state = types[names["/j"]](head, ["z"], DEPTH[number : number + 1], np.empty(0), np.empty(0))
                for topic, message in (("/w", force), ("/j", state)):
                    writer.write(topics[topic], at, store.serialize_ros1(message, names[topic]))
        return (Path(folder) / "x.bag").read_bytes()


def mcap(form: int) -> bytes:
    """A live file."""
    with tempfile.TemporaryDirectory() as folder:
        return damaged_files.valid(Path(folder) / "valid.mcap", *damaged_files.FORMS[form], count=80)


@cache
def database(views: bool = False) -> bytes:
    """The SQLite file of a bag; with ``views`` its messages are computed without end."""
    made = sqlite3.connect(":memory:")
    made.execute(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT, offered_qos_profiles TEXT)"
    )
    for number, (name, kind) in enumerate((("/w", ros_messages.WRENCH_STAMPED), ("/j", ros_messages.JOINT_STATE)), 1):
        made.execute("INSERT INTO topics VALUES(?, ?, ?, 'cdr', '')", (number, name, kind))
    if views:
        endless = "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n) SELECT k AS id, 1 AS topic_id, k AS timestamp"
        made.execute(f"CREATE VIEW messages AS {endless}, zeroblob(1000000) AS data FROM n")
    else:
        made.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB)")
        for k in range(ROWS):
            at = damaged_files.START + k * 10_000_000
            wrench = ros_messages.wrench_message(at, (0.0, 0.0, 1e-3 * k, 0.0, 0.0, 0.0))
            state = ros_messages.state_message(at, 1e-5 * k, 1e-3)
            made.executemany("INSERT INTO messages VALUES(NULL, ?, ?, ?)", [(1, at, wrench), (2, at, state)])
    made.commit()
    return made.serialize()


METADATA = """rosbag2_bagfile_information:
  version: 5
  storage_identifier: {storage}
  duration: {{nanoseconds: 1000}}
  starting_time: {{nanoseconds_since_epoch: 1790000000000000000}}
  message_count: 120
  topics_with_message_count:
    - topic_metadata: {{name: /w, type: geometry_msgs/msg/WrenchStamped, serialization_format: cdr, offered_qos_profiles: ''}}
      message_count: 60
    - topic_metadata: {{name: /j, type: sensor_msgs/msg/JointState, serialization_format: cdr, offered_qos_profiles: ''}}
      message_count: 60
  compression_format: ''
  compression_mode: ''
  relative_file_paths: [{name}]
"""


def bag(folder: Path, storage: str, data: bytes, metadata: bytes | None = None) -> Path:
    """The folder of a bag with one file."""
    made = folder / "bag"
    made.mkdir()
    name = "bag.mcap" if storage == "mcap" else "bag.db3"
    (made / name).write_bytes(data)
    (made / "metadata.yaml").write_bytes(metadata or METADATA.format(storage=storage, name=name).encode())
    return made
