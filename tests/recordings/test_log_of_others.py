# SPDX-License-Identifier: Apache-2.0
"""Logs of other recorders as recordings: other topics, other messages, bags."""

import numpy as np
import plain_log
import pytest
from mcap.writer import Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

import needleforce as nf
from needleforce.recording.log import LogWriter, read_log

STORE = get_typestore(Stores.ROS2_HUMBLE)


def kinds(recording):
    return {note.kind: note for note in recording.notes}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "run.mcap"


def stamped(kind, at, **fields):
    types = STORE.types
    stamp = types["builtin_interfaces/msg/Time"](at // 10**9, at % 10**9)
    return types[kind](types["std_msgs/msg/Header"](stamp, "some_frame_of_another_length"), **fields)


def foreign_wrench(at, values):
    vector = STORE.types["geometry_msgs/msg/Vector3"]
    wrench = STORE.types["geometry_msgs/msg/Wrench"](vector(*values[:3]), vector(*values[3:]))
    return stamped("geometry_msgs/msg/WrenchStamped", at, wrench=wrench)


def foreign_state(at, joints, velocity=True):
    numbers = {"position": np.array(list(joints.values())), "effort": np.empty(0)}
    numbers["velocity"] = np.full(len(joints), 1e-3) if velocity else np.empty(0)
    return stamped("sensor_msgs/msg/JointState", at, name=list(joints), **numbers)


def foreign_pose(at, depth):
    pose = STORE.types["geometry_msgs/msg/Pose"](
        STORE.types["geometry_msgs/msg/Point"](1.0, 2.0, depth),
        STORE.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
    )
    return stamped("geometry_msgs/msg/PoseStamped", at, pose=pose)


def foreign_messages(topics, count=400):
    """(topic, message, arrival [ns]): measured each ms by the headers, arrived up to 3 ms later."""
    for number in range(count):
        at = plain_log.START + number * 1_000_000
        for topic, make in topics.items():
            yield topic, make(at, number), at + number * 7919 % 3_000_000


TOPICS = {
    "/ft/wrench": lambda at, n: foreign_wrench(at, (n, 2.0 * n, 3.0 * n, 0.0, 0.0, 0.0)),
    "/joint_states": lambda at, n: foreign_state(at, {"needle": 1e-6 * n}),
}


def write_bag(folder, topics, plugin=StoragePlugin.MCAP):
    with BagWriter(folder, version=9, storage_plugin=plugin) as writer:
        connections = {}
        for topic, message, arrival in foreign_messages(topics):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(connections[topic], arrival, STORE.serialize_cdr(message, kind))
    return folder


def write_foreign(path, topics, little_endian=True):
    with open(path, "wb") as file:
        writer, channels = Writer(file), {}
        writer.start("ros2")
        for topic, message, arrival in foreign_messages(topics):
            kind = message.__msgtype__
            if topic not in channels:
                channels[topic] = writer.register_channel(topic, "cdr", writer.register_schema(kind, "ros2msg", b""))
            data = bytes(STORE.serialize_cdr(message, kind, little_endian=little_endian))
            writer.add_message(channels[topic], arrival, data, arrival)
        writer.finish()


@pytest.mark.parametrize("little_endian", [True, False])
def test_the_headers_of_another_recorder_give_the_times(path, little_endian):
    write_foreign(path, TOPICS, little_endian)
    recording = nf.read(path, baseline=False)
    number = np.arange(400)
    assert recording.force.tolist() == (3.0 * number).tolist()
    np.testing.assert_allclose(recording.time, number * 1e-3, atol=1e-9)
    np.testing.assert_allclose(recording.depth, number * 1e-6, atol=1e-12)
    assert any("headers" in sentence for sentence in recording.card.assumptions)


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_a_bag_gives_the_same_recording(tmp_path, plugin):
    write_foreign(tmp_path / "run.mcap", TOPICS)
    single = nf.read(tmp_path / "run.mcap", columns={"force": "fx"}, baseline=False)
    bag = nf.read(write_bag(tmp_path / "bag", TOPICS, plugin), columns={"force": "fx"}, baseline=False)
    for quantity in ("time", "depth", "velocity", "force"):
        assert getattr(bag, quantity).tolist() == getattr(single, quantity).tolist()
    assert bag.force.tolist() == list(range(400))


def test_a_bag_without_its_parts_is_refused(tmp_path):
    bag = write_bag(tmp_path / "bag", TOPICS)
    next(bag.glob("*.mcap")).write_bytes(b"nothing")
    with pytest.raises(nf.InputError, match="not an MCAP file"):
        read_log(bag)
    (bag / "metadata.yaml").write_text("{[")
    with pytest.raises(nf.InputError, match="bag is not readable"):
        read_log(bag)
    with pytest.raises(nf.InputError, match=r"not a ROS 2 bag.*metadata\.yaml"):
        read_log(tmp_path)


def test_a_missing_rosbags_names_the_package_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag2", None)
    bag = tmp_path / "bag"
    bag.mkdir()
    (bag / "metadata.yaml").touch()
    with pytest.raises(nf.InputError, match=r"needleforce\[ros\]"):
        read_log(bag)


def test_two_topics_of_one_type_need_a_choice(path):
    second = {"/ft2/wrench": lambda at, n: foreign_wrench(at, (0.0, 0.0, 7.0 * n, 0.0, 0.0, 0.0))}
    write_foreign(path, TOPICS | second)
    with pytest.raises(nf.InputError, match=r"available: /ft/wrench, /ft2/wrench.*--column force=/ft/wrench"):
        nf.read(path)
    recording = nf.read(path, columns={"force": "/ft2/wrench"}, baseline=False)
    assert recording.force.tolist() == [7.0 * n for n in range(400)]


def test_a_state_of_many_joints_needs_the_name_of_one(path):
    joints = {
        "/joint_states": lambda at, n: foreign_state(at, {"a": 0.0, "needle": 2e-6 * n, "c": 1.0}, velocity=False)
    }
    write_foreign(path, TOPICS | joints)
    with pytest.raises(nf.InputError, match=r"not named, available: a, c, needle.*--column depth=/joint_states:a"):
        nf.read(path)
    for choice in ("needle", "/joint_states:needle"):
        recording = nf.read(path, columns={"depth": choice}, baseline=False)
        np.testing.assert_allclose(recording.depth, 2e-6 * np.arange(400), atol=1e-12)
        np.testing.assert_allclose(recording.velocity, 2e-3, rtol=1e-6)
    with pytest.raises(nf.InputError, match="'elbow'"):
        nf.read(path, columns={"depth": "elbow"})


def test_the_height_of_a_pose_may_decrease_inwards(path):
    write_foreign(path, {"/ft/wrench": TOPICS["/ft/wrench"], "/tip": lambda at, n: foreign_pose(at, 0.3 - 1e-6 * n)})
    recording = nf.read(path, inwards="decreasing", baseline=False)
    np.testing.assert_allclose(recording.depth, 1e-6 * np.arange(400) - 0.3, atol=1e-12)


def test_a_wrench_without_a_header_uses_its_arrival_time(path):
    def bare(at, n):
        return foreign_wrench(at, (0.0, 0.0, float(n), 0.0, 0.0, 0.0)).wrench

    write_foreign(path, TOPICS | {"/ft/wrench": bare})
    recording = nf.read(path, baseline=False)
    arrival = np.sort([at for topic, _, at in foreign_messages(TOPICS) if topic == "/ft/wrench"])
    assert any("arrival" in sentence for sentence in recording.card.assumptions)
    np.testing.assert_allclose(recording.time, (arrival - arrival[0]) / 1e9, atol=1e-9)
    assert len(recording) == 400


def test_a_log_without_wrenches_is_refused(path):
    LogWriter(path, {}).close({})
    with pytest.raises(nf.InputError, match="number of wrenches is 0"):
        nf.read(path)


def test_one_damaged_joint_name_is_ignored(path):
    def joints(at, n):
        return foreign_state(at, {"needlf" if n == 100 else "needle": 2e-6 * n})

    write_foreign(path, TOPICS | {"/joint_states": joints})
    np.testing.assert_allclose(nf.read(path, baseline=False).depth, 2e-6 * np.arange(400), atol=1e-12)


def test_a_motion_is_stated_where_the_log_has_none(path):
    write_foreign(path, {"/ft": lambda at, number: foreign_wrench(at, (0.0, 0.0, 0.01 * number, 0.0, 0.0, 0.0))})
    with pytest.raises(nf.InputError, match=r"no JointState.*--speed-mm-s"):
        nf.read(path)
    run = nf.read(path, speed=10e-3, stroke=3e-3, motion_shift=0.05)
    np.testing.assert_allclose(run.depth, np.clip(10e-3 * (run.time - 0.05), 0.0, 3e-3), atol=1e-12)


def test_topics_of_other_types_are_named(path):
    text = STORE.types["std_msgs/msg/String"]
    write_foreign(path, {"/europa": lambda at, number: text(f"{number} N")})
    with pytest.raises(nf.InputError, match=r"number of wrenches is 0.*it has /europa \(std_msgs/msg/String\).*as CSV"):
        nf.read(path)
    with pytest.raises(nf.InputError, match=r"of the type WrenchStamped or Wrench there is none.*as CSV"):
        nf.read(path, columns={"force": "/europa"})
