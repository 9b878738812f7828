# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Files for ``hostile_files.py`` that take far more to read than to store: depth, width, and compression."""

import random
import struct
from io import BytesIO
from pathlib import Path

import hostile_array_bombs
import hostile_changes
import numpy as np
from hostile_content import CALIBRATION, ENDINGS, METADATA, bag, database, parquet_bytes
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk

from needleforce.files import MCAP
from needleforce.recording.log import ros_messages


def bomb(kind: str, folder: Path, chance: random.Random) -> Path:
    """A file that takes far more to read than to store."""
    path = folder / f"x{ENDINGS[kind]}"
    many = chance.choice([10**4, 10**5, 10**6])
    match kind:
        case "csv" | "table":
            _write_text_bomb(path, many, chance)
        case "parquet":
            path.write_bytes(chance.choice([_parquet_of_zeros, _parquet_with_a_huge_page, _parquet_of_columns])(many))
        case "mcap":
            path.write_bytes(_mcap_bomb(chance))
        case _ if kind in hostile_changes.ENDINGS:
            path.write_bytes(hostile_array_bombs.bomb(kind, chance))
        case "bag":
            return _bag_bomb(folder, chance)
        case "toml" | "mapping":
            path.write_text(_toml_bomb(many // 2, chance))
        case "json":
            path.write_text(
                chance.choice(
                    ["[" * many, '{"a":' * many, "[" + "[]," * many + "0]", "9" * many, '"' + "\\u0000" * many + '"']
                )
            )
        case "page":
            path.write_text(_xml_bomb(many, chance))
        case "calibration":
            ending = chance.choice(list(CALIBRATION))
            path = path.with_suffix(ending)
            texts = {
                ".toml": _toml_bomb,
                ".cal": _xml_bomb,
                ".csv": lambda n, _: "axis,unit" + ",0" * n + "\n" + "fx,N" + ",0" * n,
            }
            path.write_text(texts[ending](many // 2, chance))
    return path


def _write_text_bomb(path: Path, many: int, chance: random.Random) -> None:
    form = chance.randrange(7)
    with open(path, "w") as file:
        if form == 0:  # columns
            file.write(
                "time_s,depth_mm,force_N"
                + "".join(f",c{k}" for k in range(many))
                + "\n"
                + ("0" + ",0" * (many + 2) + "\n") * 3
            )
        elif form == 1:  # one line
            file.write("time_s,depth_mm,force_N\n0,0,")
            file.writelines("9" * 1_000_000 for _ in range(many // 20_000 + 1))
        elif form == 2:  # comments
            file.writelines("# note: gap 1 x\n" for _ in range(many))
        elif form == 3:  # blank lines
            file.write("\n" * many)
        elif form == 4:  # a quote that is not closed
            file.write('time_s,depth_mm,force_N\n"' + "0,0,0\n" * many)
        elif form == 5:  # short rows
            file.write("time_s,depth_mm,force_N\n" + "0\n" * many)
        else:  # headers for which a search takes long
            file.write("time_s,depth_mm," + chance.choice(["(", "_", " ( ", "/ "]) * 20_000 + "\n0,0,0\n")


def _parquet_of_zeros(many: int) -> bytes:
    """Values that take no space."""
    import pyarrow
    import pyarrow.parquet

    zeros = np.zeros(20 * many)
    made = BytesIO()
    columns = dict.fromkeys(("time_s", "depth_m", "force_N", "fx_N", "fy_N", "tx_N_m"), zeros)
    pyarrow.parquet.write_table(pyarrow.table(columns), made, compression="zstd")
    return made.getvalue()


def _parquet_with_a_huge_page(many: int) -> bytes:
    """The sizes in the page headers are replaced by larger ones of as many bytes."""
    data = bytearray(parquet_bytes("zstd"))
    at = data.find(b"\x15", 4, 40)
    data[at + 2 : at + 6] = b"\x15\xfe\xff\xff"
    return bytes(data)


def _parquet_of_columns(many: int) -> bytes:
    import pyarrow
    import pyarrow.parquet

    made = BytesIO()
    columns = {f"c{k}": np.zeros(2) for k in range(min(many, 20_000) // 4)}
    pyarrow.parquet.write_table(pyarrow.table(columns), made)
    return made.getvalue()


def _chunk(data: bytes, compression: str, size: int) -> bytes:
    builder = RecordBuilder()
    Chunk(
        compression=compression,
        data=data,
        message_start_time=0,
        message_end_time=0,
        uncompressed_crc=0,
        uncompressed_size=size,
    ).write(builder)
    return builder.end()


def _mcap_bomb(chance: random.Random) -> bytes:
    import lz4.frame
    import zstandard

    size = chance.choice([1 << 26, (1 << 26) + 1, 1 << 32, 2**63, 2**64 - 1])
    zeros = bytes(1 << 24)
    packed = {"zstd": zstandard.compress(zeros), "lz4": lz4.frame.compress(zeros)}
    compression = chance.choice(list(packed))
    forms = [
        _chunk(packed[compression], compression, size),
        _chunk(packed[compression] * 8, compression, 1 << 27),
        _chunk(packed[compression], compression, 1 << 24) * chance.choice([10, 100]),
        struct.pack("<BQ", 4, size % 2**64) + b"x" * 100,
        struct.pack("<BQ", 12, 200) + struct.pack("<I", 2**32 - 1) + b"x" * 196,
        _marks(chance),
    ]
    return MCAP + chance.choice(forms)


def _marks(chance: random.Random) -> bytes:
    """Marks whose facts take far more memory than their text."""
    from mcap.writer import Writer

    text = '{"kind": "a", "x": [' + "[]," * chance.choice([100, 20_000, 2_000_000]) + "0]}"
    made = BytesIO()
    writer = Writer(made, chunk_size=1 << 22)
    writer.start("ros2", "x")
    schema = writer.register_schema(ros_messages.STRING, "ros2msg", b"string data")
    channel = writer.register_channel("/needle/marks", "cdr", schema)
    data = ros_messages.string_message(text)
    for number in range(min(200, (50 << 20) // len(data))):
        writer.add_message(channel, number, data, number, number)
    writer.finish()
    return made.getvalue()[len(MCAP) :]


def _bag_bomb(folder: Path, chance: random.Random) -> Path:
    match chance.randrange(5):
        case 0:
            return bag(folder, "sqlite3", database(views=True))
        case 1:
            return bag(folder, "mcap", _mcap_bomb(chance))
        case 2:
            levels = "".join(f"l{k}: &l{k} {{<<: [*l{k - 1}, *l{k - 1}]}}\n" for k in range(1, 40))
            return bag(folder, "mcap", MCAP, b"l0: &l0 {a: 1}\n" + levels.encode())
        case 3:
            return bag(folder, "mcap", MCAP, b"[" * chance.choice([1000, 10**5, 10**6]))
    made = METADATA.format(storage="mcap", name="bag.mcap.zstd").replace(
        "compression_mode: ''", "compression_mode: FILE"
    )
    return bag(folder, "mcap", MCAP, made.replace("compression_format: ''", "compression_format: zstd").encode())


def _toml_bomb(many: int, chance: random.Random) -> str:
    forms = ["a" + ".a" * many + " = 1", "[a" + ".a" * many + "]", "a = " + "[" * many, "a = " + "{a=" * many, "a = " + "9" * many,
             "a = 0x" + "f" * many, "a = [" + "[]," * (many // 2) + "]", "a = [" + "{}," * (many // 2) + "]", "[[a]]\n" * (many // 6),
             'a = """' + "\\" * many, "a" * many + " = 1", "".join(f"k{k} = 1\n" for k in range(many // 10)), "a = 1" + " " * many,
             'a={b="""x"""", ' + "a." * many + "a=1}", "\n" * many, "a = 1e" + "9" * many, "#" * many]  # fmt: skip
    return chance.choice(forms)


def _xml_bomb(many: int, chance: random.Random) -> str:
    laughs = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
    forms = ["<a>" * many, "<a" + ' b="c"' * (many // 6) + "/>", f'<!DOCTYPE a [<!ENTITY l0 "x">{laughs}]><a>&l11;</a>', "<a>" + "&#65;" * (many // 5) + "</a>",
             "<a><!--" + "-" * many, "<a>" + "<b/>" * (many // 4) + "</a>", "<" + "a" * many + "/>"]  # fmt: skip
    return chance.choice(forms)
