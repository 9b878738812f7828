# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 messages in the file, as the text that tells any reader how to decode them (schema encoding ros2msg).

Field by field as common_interfaces has them: https://github.com/ros2/common_interfaces
"""

WRENCH_STAMPED = "geometry_msgs/msg/WrenchStamped"
WRENCH = "geometry_msgs/msg/Wrench"
JOINT_STATE = "sensor_msgs/msg/JointState"
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
STRING = "std_msgs/msg/String"

_FIELDS = {
    "geometry_msgs/WrenchStamped": "std_msgs/Header header\ngeometry_msgs/Wrench wrench",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force\ngeometry_msgs/Vector3 torque",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "sensor_msgs/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/String": "string data",
}


def schema_text(message: str) -> str:
    """The definition of a message, such as ``WRENCH_STAMPED``, and of all it is made of, each after a line of ``=``."""
    names = [message.replace("/msg/", "/")]
    for name in names:  # grows while it is walked
        kinds = (line.split()[0].removesuffix("[]") for line in _FIELDS[name].splitlines())
        names += [kind for kind in kinds if kind in _FIELDS and kind not in names]
    first, *others = names
    parts = [_FIELDS[first], *(f"MSG: {name}\n{_FIELDS[name]}" for name in others)]
    return ("\n" + "=" * 80 + "\n").join(parts) + "\n"
