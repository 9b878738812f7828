# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Valid files of arrays for ``hostile_files.py``: NumPy, MATLAB, HDF5, TDMS, JSON, ROS 1 bags and force curves."""

import json
import tempfile
from functools import cache
from io import BytesIO
from pathlib import Path

import curve_files
import damaged_files
import numpy as np
from hostile_tables import DEPTH, FORCE, ROWS, TIME

from needleforce.errors import InputError
from needleforce.recording.formats.detect import tables_of

ENDINGS = {"npy": ".npy", "npz": ".npz", "matlab": ".mat", "matlab73": ".mat", "hdf5": ".h5", "tdms": ".tdms", "records": ".jsonl",
           "ros1": ".bag", "jpk": ".jpk-force", "igor": ".ibw", "nanosurf": ".nid"}  # fmt: skip
N_FORMS = 6
_MAX_READ = 200  # columns of a file that are read


def read_tables(path: Path) -> None:
    """Open the tables of a file, and read their columns."""
    count = 0
    for table in tables_of(path):
        for index in range(len(table.headers)):
            count += 1
            if count > _MAX_READ:
                return
            try:
                table.numbers(index)
            except InputError:
                continue


def content(kind: str, form: int) -> bytes:
    """A valid content of a format in one of ``N_FORMS`` forms."""
    return _MADE[kind](form)


@cache
def _npy(form: int) -> bytes:
    made = BytesIO()
    matrix = np.stack([TIME, DEPTH, FORCE], axis=1)
    fields = [("t", "<f8"), ("F", ">f4"), ("more", [("x", "<i2"), ("y", "<f8", (3,))])]
    arrays = [matrix, np.asfortranarray(matrix), matrix.T.astype(">f4"), np.zeros(ROWS, dtype=fields),
              np.array([{"a": 1}] * ROWS, dtype=object), (1e6 * TIME).astype("m8[us]")]  # fmt: skip
    np.save(made, arrays[form])
    return made.getvalue()


@cache
def _npz(form: int) -> bytes:
    made = BytesIO()
    save = np.savez_compressed if form % 2 else np.savez
    more = {"objects": np.array([None] * ROWS)} if form > 3 else {"matrix": np.zeros((ROWS, 3)), "single": 3.0}
    save(made, time=TIME, depth=DEPTH, force=FORCE.astype(np.float32), **more)
    return made.getvalue()


@cache
def _matlab(form: int) -> bytes:
    from scipy.io import savemat

    runs = np.array([(TIME, FORCE), (TIME[:9], FORCE[:9])], dtype=[("t", object), ("F", object)])
    names = {"units": {"time": "s", "F": "N"}, "time": TIME, "F": FORCE[:, None]}
    variables = {"time": TIME, "M": np.zeros((ROWS, 3)), "run": runs, "s": names, "text": "a", "fs": 100.0}
    if form == 5:
        variables = {"time": TIME, "force": FORCE.astype(np.int16), "M": np.zeros((ROWS, 3), np.float32)}
    made = BytesIO()
    savemat(made, variables, format="4" if form == 5 else "5", do_compression=form % 2 == 1 and form < 5)
    return made.getvalue()


def h5_bytes(fill, **options) -> bytes:
    import h5py

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.h5"
        with h5py.File(path, "w", **options) as file:
            fill(file)
        return path.read_bytes()


@cache
def _hdf5(form: int) -> bytes:
    def fill(file):
        group = file.create_group("run")
        filters = [{}, {"compression": "gzip", "shuffle": True}, {"compression": "lzf"}, {"fletcher32": True, "chunks": (7,)},
                   {"scaleoffset": 6}, {"chunks": (16,), "maxshape": (None,)}][form]  # fmt: skip
        for name, values, unit in (("time", TIME, "s"), ("depth", DEPTH, "m"), ("force", FORCE.astype("<f4"), b"N")):
            group.create_dataset(name, data=values, **filters).attrs["units"] = unit
        matrix = file.create_dataset("matrix", data=np.zeros((ROWS, 3), ">i2"))
        matrix.attrs["columns"] = ["a", "b", "c"]
        file.create_dataset("rows", data=np.zeros(9, dtype=[("t", "f8"), ("text", "S3")]))
        file.attrs["rate"] = 100.0
        file["again"] = group

    return h5_bytes(fill, libver=("earliest", "latest")[form % 2])


@cache
def _matlab73(form: int) -> bytes:
    import h5py

    def stored(group, name, values, kind="double"):
        made = group.create_dataset(name, data=values, **({"compression": "gzip"} if form % 2 else {}))
        made.attrs["MATLAB_class"] = np.bytes_(kind)
        return made

    def fill(file):
        stored(file, "time", TIME[None, :]), stored(file, "M", np.zeros((3, ROWS)))
        stored(file, "text", np.array([[97], [98]], "<u2"), "char")
        referred = file.create_group("#refs#")
        parts = [stored(referred, name, values[None, :]) for name, values in zip("abcd", (TIME, FORCE, TIME, DEPTH))]
        runs = file.create_group("run")
        runs.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, pair in (("t", parts[:2]), ("F", parts[2:])):
            runs.create_dataset(name, data=np.array([[each.ref] for each in pair], dtype=h5py.ref_dtype))
        cells = np.array([[each.ref for each in parts]], dtype=h5py.ref_dtype)
        file.create_dataset("cells", data=cells).attrs["MATLAB_class"] = np.bytes_("cell")
        if form > 3:
            stored(file, "T", np.zeros(6, "<u4"), "table")

    return b"MATLAB 7.3 MAT-file".ljust(512, b" ") + h5_bytes(fill, userblock_size=512)[512:]


@cache
def _tdms(form: int) -> bytes:
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    made = BytesIO()
    even = {"wf_increment": 0.01, "wf_start_offset": 0.0, "unit_string": "N"}
    scaled = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 2.0,
              "NI_Scale[0]_Linear_Y_Intercept": 1.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF,
              "NI_Scaling_Status": "unscaled"}  # fmt: skip
    with TdmsWriter(made) as writer:
        for part in range(1 + form % 3):
            objects = [ChannelObject("run", "force", FORCE, even if form < 3 else scaled)]
            objects += [ChannelObject("run", "depth", (1e6 * DEPTH).astype(np.int16), {"unit_string": "um"})]
            objects += [ChannelObject("other", "text", ["a"] * 5)] if form > 3 else []
            if part == 0:
                objects = [RootObject({"title": "a"}), GroupObject("run", {"rate": 100.0}), *objects]
            writer.write_segment(objects)
    return made.getvalue()


@cache
def _records(form: int) -> bytes:
    rows = [
        {"t": t, "q": [d, 0.0], "w": {"fz": f, "name": "a"}}
        for t, d, f in zip(*map(np.ndarray.tolist, (TIME, DEPTH, FORCE)))
    ]
    lists = {
        "time": TIME.tolist(),
        "run": {"force": FORCE.tolist(), "M": np.zeros((9, 3)).tolist()},
        "units": {"time": "s"},
    }
    texts = ["\n".join(map(json.dumps, rows)), json.dumps(rows), json.dumps(lists), json.dumps(lists, indent=1),
             json.dumps({"columns": ["t"], "data": [[t] for t in TIME.tolist()]}), json.dumps({"t": dict(enumerate(TIME.tolist()))})]  # fmt: skip
    return texts[form].encode()


@cache
def _ros1(form: int) -> bytes:
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


@cache
def _igor(form: int) -> bytes:
    columns = np.stack([1e-6 * DEPTH, 1e-9 * FORCE, 1e-6 * DEPTH], axis=1)
    labels, note = ("Raw", "Defl", "ZSnsr"), "SpringConstant:0.05\rNumPtsPerSec:100\r"
    waves = [
        (FORCE, 0.01, "N"),
        (columns, 0.01, "m", "s", labels, note),
        (columns.T, 0.01, "m", "s"),
        (columns, 0.0, "", ""),
    ]
    return curve_files.igor_wave(*waves[form % len(waves)])


_MADE = {
    "npy": _npy,
    "npz": _npz,
    "matlab": _matlab,
    "matlab73": _matlab73,
    "hdf5": _hdf5,
    "tdms": _tdms,
    "records": _records,
    "ros1": _ros1,
    "jpk": cache(lambda form: curve_files.jpk(force=form > 0)),
    "igor": _igor,
    "nanosurf": cache(lambda form: curve_files.nanosurf(1 + form % 3)),
}
