# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags as recordings: written by rosbags, without index, damaged, and with chunks that expand."""

import bz2
import struct
import sys

import numpy as np
import plain_log
import pytest

import needleforce as nf
from needleforce.recording.log import read_log

rosbags = pytest.importorskip("rosbags.rosbag1")
typesys = pytest.importorskip("rosbags.typesys")
STORE = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
TYPES = STORE.types
WRENCH, STATE = "geometry_msgs/msg/WrenchStamped", "sensor_msgs/msg/JointState"
COUNT = 300


def head(number):
    at = plain_log.START + number * 1_000_000
    return TYPES["std_msgs/msg/Header"](
        number, TYPES["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9), "a_frame"
    )


def wrench(number, factor=3.0):
    vector = TYPES["geometry_msgs/msg/Vector3"]
    forces = TYPES["geometry_msgs/msg/Wrench"](vector(0.0, 1.0, factor * number), vector(0.0, 0.0, 0.0))
    return TYPES[WRENCH](head(number), forces)


def state(number):
    return TYPES[STATE](head(number), ["needle"], np.array([1e-6 * number]), np.array([1e-3]), np.empty(0))


def pose(number):
    point, turn = TYPES["geometry_msgs/msg/Point"], TYPES["geometry_msgs/msg/Quaternion"]
    place = TYPES["geometry_msgs/msg/Pose"](point(1.0, 2.0, 1e-6 * number), turn(0.0, 0.0, 0.0, 1.0))
    return TYPES["geometry_msgs/msg/PoseStamped"](head(number), place)


def write(path, topics, compression=None):
    writer = rosbags.Writer(path)
    if compression:
        writer.set_compression(rosbags.Writer.CompressionFormat[compression])
    with writer:
        connections = {}
        for number in range(COUNT):
            for topic, make in topics.items():
                message = make(number)
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
                arrival = plain_log.START + number * 1_000_000 + number * 7919 % 900_000
                writer.write(connections[topic], arrival, STORE.serialize_ros1(message, kind))
    return path


@pytest.mark.parametrize("compression", [None, "BZ2", "LZ4"])
@pytest.mark.parametrize("place", [state, pose])
def test_a_bag_is_read_by_the_times_in_its_headers(tmp_path, compression, place):
    path = write(tmp_path / "run.any", {"/ft": wrench, "/place": place}, compression)
    recording = nf.read(path, baseline=False)
    number = np.arange(COUNT)
    assert recording.force.tolist() == (3.0 * number).tolist()
    np.testing.assert_allclose(recording.time, number * 1e-3, atol=1e-9)
    np.testing.assert_allclose(recording.depth, number * 1e-6, atol=1e-12)
    assert recording.axes["fy"].tolist() == [1.0] * COUNT and recording.card.sha256


def test_several_topics_need_a_choice(tmp_path):
    path = write(tmp_path / "x.bag", {"/a": wrench, "/b": lambda n: wrench(n, 7.0), "/j": state})
    with pytest.raises(nf.InputError, match=r"available: /a, /b.*--column force=/a"):
        nf.read(path)
    assert nf.read(path, columns={"force": "/b"}, baseline=False).force[-1] == 7.0 * (COUNT - 1)


def test_a_bag_without_index_is_refused_with_the_command_that_makes_one(tmp_path):
    path = write(tmp_path / "x.bag", {"/ft": wrench, "/j": state})
    data = bytearray(path.read_bytes())
    at = data.index(b"index_pos=") + len(b"index_pos=")
    data[at : at + 8] = bytes(8)
    path.write_bytes(data)
    with pytest.raises(nf.InputError, match=r"bag is without an index.*rosbag reindex x\.bag"):
        nf.read(path)


def test_a_truncated_or_older_bag_is_refused(tmp_path):
    whole = write(tmp_path / "x.bag", {"/ft": wrench, "/j": state}).read_bytes()
    for size in range(13, len(whole), 4001):
        (tmp_path / "x.bag").write_bytes(whole[:size])
        with pytest.raises(nf.InputError, match=r"x\.bag"):
            nf.read(tmp_path / "x.bag")
    (tmp_path / "x.bag").write_bytes(b"#ROSBAG V1.2\n" + whole[13:])
    with pytest.raises(nf.InputError, match=r"bag is of version V1\.2.*rosbag fix"):
        nf.read(tmp_path / "x.bag")


def test_a_chunk_that_expands_is_refused(tmp_path):
    path = write(tmp_path / "x.bag", {"/ft": wrench, "/j": state}, "BZ2")
    data = path.read_bytes()
    begin = data.index(b"BZh")
    (size,) = struct.unpack_from("<I", data, begin - 4)
    bomb = bz2.compress(bytes(300_000_000))
    assert len(bomb) < size  # what follows the stream is ignored
    path.write_bytes(data[:begin] + bomb.ljust(size, b"\0") + data[begin + size :])
    with pytest.raises(nf.InputError, match="unpacked size is over 256 MiB"):
        nf.read(path)


def test_without_rosbags_the_extra_is_named(tmp_path, monkeypatch):
    path = write(tmp_path / "x.bag", {"/ft": wrench, "/j": state})
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(nf.InputError, match=r"ROS 1 bags.*needleforce\[ros\]"):
        read_log(path)
