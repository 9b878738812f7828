# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""The content of hostile files for ``hostile_files.py``: valid files, and changes of them."""

import random
import sqlite3
from functools import cache
from io import BytesIO
from pathlib import Path

import damaged_files
import hostile_changes
import numpy as np

from needleforce.recording.log import ros_messages
from needleforce.wire.sensor_configuration import SensorConfiguration

ENDINGS = {"csv": ".csv", "parquet": ".parquet", "mcap": ".mcap", "bag": "", "toml": ".toml", "json": ".json", "mapping": ".toml",
           "page": ".xml", "calibration": ".cal", "table": ".csv", **hostile_changes.ENDINGS}  # fmt: skip
ROOT = Path(__file__).parents[1]
ROWS = 60
CELLS = [
    "nan", "inf", "-inf", "1e999", "1e-999", "", "x", "9" * 400, "0x10", "1_0", "١", "=1+1", '"', '"a\n', "\0", "\r", "#", "1,1", ";",
    "\t", "  ", "1e308", "-1e308", "5e-324", "\u202e", "\x1b[2J", "é", "\ufeff", "1" * 5001, "a" * 300, "[" * 200, "true", "1979-05-27",
]  # fmt: skip
NUMBERS = ["0", "-1", "1e-6", "1e6", "1e300", "-1e-300", "12345678901234567890", "0.5", "2e9"]
CARDS = ["motion: /dev/zero", "motion: run.csv", "motion: ..", "filter_length: 1e999", "filter_length: 1e9", "note: a 9 b",
         "note: gap " + "9" * 20 + " x", "start_depth_m: nan", "start_depth_m: 1e308", "assumption: \x1b]0;x\x07", "origin: " + "x" * 9999,
         "speed_mm_s: =1+1", "needle: \\xff\\x00"]  # fmt: skip
KEYS = ['"', "'''", '"""', "[", "]", "[[", "{", "}", "a.b.c.d = 1", "[a.b]", "=", ".", ",", "\\", "#", "inf", "-nan", "1e308", "1e400",
        "-1e308", "9" * 400, "0x" + "f" * 200, "1979-05-27T07:32:00Z", "[" * 40, "a." * 40 + "a=1", "[" * 5000, "\0", "\ufeff", "true",
        "{a={b={}}}", "[[[]]]", '""', "null", "-0", "5e-324", "\ud800".encode("utf-8", "replace").decode()]  # fmt: skip
OPTIONS = ["rate_hz = 0\n", "speed_mm_s = 1e300\n", "step_um = -1e-300\n", "first_row = 0\n", "first_row = 999999999999\n", 'part = "x"\n',
           "part = -1\n", 'columns.force = "*"\n', 'columns.force = "***********************a"\n', "columns.force = 0\n", "columns.time = -1\n",
           "columns.force = []\n", 'columns.x = "a"\n', 'units.force = "-1e308N"\n', 'units.force = "0N"\n', 'units.time = "N"\n',
           'units.depth = "1e-320mm"\n', 'inwards = ""\n', "filter_length = 0\n", "filter_length = 999999999999\n", "start_depth_mm = nan\n",
           'mapping = "x.toml"\n', "columns.force = 3\ncolumns.depth = 3\n", 'columns."motion.time" = 1\n']  # fmt: skip
TAGS = ["<!DOCTYPE a>", '<!DOCTYPE a [<!ENTITY b "c">]>', "&b;", "&#0;", "&#x110000;", "<a>", "</a>", "<![CDATA[", "]]>", "<?x?>", "<!--",
        "1e-6", "1e999", "nan", "-1", "0", "N" * 5000, "lbf-in", '"', "<", ">", "&", "9" * 400, '<?xml version="1.0" encoding="utf-16"?>',
        '<?xml version="1.0" encoding="x"?>']  # fmt: skip


def csv_text() -> str:
    """A valid recording in text."""
    depth = np.linspace(-5.0, 20.0, ROWS)
    rows = (f"{0.01 * k:.3f},{at:.4f},{0.04 * max(at, 0.0):.5f}" for k, at in enumerate(depth))
    return "\n".join(["time_s,depth_mm,force_N", *rows]) + "\n"


@cache
def parquet_bytes(codec: str = "zstd", version: str = "1.0", dictionary: bool = False) -> bytes:
    import pyarrow
    import pyarrow.parquet

    depth = np.linspace(-5e-3, 20e-3, ROWS)
    columns = {"time_s": 0.01 * np.arange(ROWS), "depth_m": depth, "force_N": 40.0 * depth.clip(0.0)}
    made = BytesIO()
    options = {"use_dictionary": dictionary, "data_page_version": version, "row_group_size": 25}
    pyarrow.parquet.write_table(pyarrow.table(columns), made, compression=codec, **options)
    return made.getvalue()


@cache
def mcap_bytes(form: int, folder: Path) -> bytes:
    return damaged_files.valid(folder / "valid.mcap", *damaged_files.FORMS[form], count=80)


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


@cache
def definitions() -> list[str]:
    """Presets and protocols, which have all sections that are read."""
    found = sorted((ROOT / "src/needleforce/presets").glob("*.toml")) + sorted(
        (ROOT / "src/needleforce/protocol/protocols").glob("*.toml")
    )
    return [path.read_text(encoding="utf-8") for path in found]


CALIBRATION = {
    ".toml": 'force_unit = "N"\ntorque_unit = "Nmm"\nmatrix = [\n'
    + "".join(f"  [{', '.join(str(float(k == i)) for k in range(6))}],\n" for i in range(6)) + "]\n",
    ".csv": "axis,unit,g0,g1,g2,g3,g4,g5\n"
    + "".join(f"{axis},{'N' if axis[0] == 'f' else 'Nm'},{','.join(str(float(k == i)) for k in range(6))}\n"
              for i, axis in enumerate(("fx", "fy", "fz", "tx", "ty", "tz"))),
    ".cal": '<?xml version="1.0"?><FTSensor Serial="FT1"><Calibration ForceUnits="N" TorqueUnits="N-m" DistUnits="m" OutputRange="20">'
    + "".join(f'<UserAxis Name="{axis}" max="10" values="{" ".join(str(float(k == i)) for k in range(6))}"/>'
              for i, axis in enumerate(("Fx", "Fy", "Fz", "Tx", "Ty", "Tz"))) + "</Calibration></FTSensor>",
}  # fmt: skip
TABLES = ["file,specimen,repeat\n" + "".join(f"run_{k}.csv,gel,{k}\n" for k in range(9)),
          "stretch,stress_kPa\n" + "".join(f"{1 + 0.01 * k:.2f},{0.3 * k:.2f}\n" for k in range(1, 20))]  # fmt: skip


@cache
def mappings() -> list[str]:
    """Mappings of instruments: the shipped ones, and one with every option."""
    found = sorted((ROOT / "src/needleforce/recording/mappings").glob("*.toml"))
    texts = [path.read_text(encoding="utf-8") for path in found]
    own = 'description = "a"\nfilter_length = 2\ninwards = "increasing"\nfirst_row = 3\n'
    columns = (
        '[columns]\ntime = ["Zeit", "time_s"]\ndepth = 2\nforce = "force_N"\n[units]\nforce = "mN"\ndepth = "um"\n'
    )
    rate = 'rate_hz = 100\npart = 1\n[columns]\nforce = "force_N"\ndepth = "depth_mm"\n'
    step = 'step_um = 5\nstart_depth_mm = 1\n[columns]\nforce = "force_N"\n[units]\nforce = "0.0122N"\n'
    speed = 'speed_mm_s = 2\n[columns]\nforce = "f*"\ntime = 1\n'
    return [*texts, own, own + columns, rate, step, speed]


@cache
def fit() -> str:
    """The JSON of a fit, as far as it is read."""
    import json
    import tomllib

    preset = tomllib.loads(definitions()[0])
    recordings = [{"file": "a.csv", "status": "ok", "sha256": "0" * 64}]
    return json.dumps(
        {"recordings": recordings, "parameters": [], "model": "paper", "preset": preset, "settings": {}, "warnings": []}
    )


def valid(kind: str, folder: Path) -> Path:
    """A valid file of a format."""
    path = folder / f"valid{ENDINGS[kind]}"
    if kind == "bag":
        return bag(folder, "sqlite3", database())
    path.write_bytes(_content(kind, folder, random.Random(0), path)[1])
    return path


def _content(kind: str, folder: Path, chance: random.Random, path: Path) -> tuple[Path, bytes]:
    """The path, which may have another ending, and a valid content."""
    page = SensorConfiguration(1e6, 1e6, 1000.0, "FT1", (1.0,) * 6)
    match kind:
        case "csv":
            return path, csv_text().encode()
        case _ if kind in hostile_changes.ENDINGS:
            return path, hostile_changes.content(kind, chance)
        case "parquet":
            form = (
                chance.choice(["zstd", "snappy", "gzip", "none", "lz4", "brotli"]),
                chance.choice(["1.0", "2.0"]),
                chance.random() < 0.5,
            )
            return path, parquet_bytes(*form)
        case "mcap":
            return path, mcap_bytes(chance.randrange(4), folder.parent)
        case "toml":
            return path, chance.choice(definitions()).encode()
        case "json":
            return path, fit().encode()
        case "mapping":
            return path, chance.choice(mappings()).encode()
        case "page":
            return path, page.xml()
        case "calibration":
            ending = chance.choice(list(CALIBRATION))
            return path.with_suffix(ending), CALIBRATION[ending].encode()
    return path, chance.choice(TABLES).encode()


def changed(kind: str, folder: Path, chance: random.Random) -> Path:
    """A valid file of a format with changes."""
    if kind == "bag":
        return _changed_bag(folder, chance)
    if kind in hostile_changes.ENDINGS:
        path = folder / f"x{ENDINGS[kind]}"
        path.write_bytes(hostile_changes.changed(kind, chance))
        return path
    path, data = _content(kind, folder, chance, folder / f"x{ENDINGS[kind]}")
    words = {"csv": [*CELLS, *(f"\n# {card}\n" for card in CARDS)], "table": CELLS, "toml": KEYS, "json": KEYS, "mapping": KEYS + OPTIONS, "page": TAGS,
             "calibration": KEYS + TAGS + CELLS}.get(kind)  # fmt: skip
    if words is None or chance.random() < 0.3:
        data = damaged_files.damaged(data, chance)
    else:
        data = _with_words(data.decode(), words, chance)
    if kind in ("csv", "page", "toml", "mapping", "table", "calibration") and chance.random() < 0.05:
        data = data.decode("utf-8", "replace").encode(
            chance.choice(["utf-16", "utf-32", "utf-16-be", "utf-7", "cp037"]), "replace"
        )
    path.write_bytes(data)
    return path


def _with_words(text: str, words: list[str], chance: random.Random) -> bytes:
    """Values replaced, and words inserted, removed or repeated."""
    import re

    for _ in range(chance.choice([1, 1, 2, 4])):
        word = chance.choice(words) if chance.random() < 0.6 else chance.choice(NUMBERS)
        if chance.random() < 0.7:  # in place of a value
            values = list(re.finditer(r"-?\d[\d.e+-]*|\w+", text))
            if values:
                at = chance.choice(values)
                text = text[: at.start()] + word + text[at.end() :]
        else:
            at = chance.randrange(len(text) + 1)
            text = text[:at] + word * chance.choice([1, 1, 1, 2, 50, 1000]) + text[at + chance.choice([0, 0, 10]) :]
    return text.encode("utf-8", "replace")


def _changed_bag(folder: Path, chance: random.Random) -> Path:
    storage = chance.choice(["mcap", "sqlite3"])
    data = mcap_bytes(chance.randrange(4), folder.parent) if storage == "mcap" else database()
    name = "bag.mcap" if storage == "mcap" else "bag.db3"
    metadata = METADATA.format(storage=storage, name=name).encode()
    if chance.random() < 0.5:
        data = damaged_files.damaged(data, chance)
    else:
        words = [
            *KEYS,
            "&a",
            "*a",
            "<<: *a",
            "../../x",
            "/dev/zero",
            "!!python/object:os.system",
            "- " * 300,
            "zstd",
            "mcap",
            "sqlite3",
        ]
        metadata = _with_words(metadata.decode(), words, chance)
    made = bag(folder, storage, data, metadata)
    if chance.random() < 0.05:
        (made / "more.db3").symlink_to("/dev/zero")
    return made
