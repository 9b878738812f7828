# SPDX-License-Identifier: Apache-2.0
"""Live recordings with random damage, read back: no crash, no hang, no unbounded memory.

    python benchmarks/damaged_files.py [--files 10000]

Every file is a valid one, chunked or not and compressed or not, with one to four changes: bytes changed, bits flipped,
a piece removed, duplicated or moved, the end removed, a length made huge. It is read completely, read in part, or
refused with an InputError; anything else ends the benchmark. The worst processor time is printed as a ratio to the
median of valid files.
"""

import argparse
import random
import resource
import struct
import sys
import tempfile
import time
import warnings
from pathlib import Path

from mcap.writer import CompressionType, Writer

import needleforce as nf
from needleforce.recording import read
from needleforce.recording.log import ros_messages

FORMS = [(True, CompressionType.ZSTD), (True, CompressionType.LZ4), (True, CompressionType.NONE),
         (False, CompressionType.NONE)]  # fmt: skip
HUGE = (2**63, 2**64 - 1, 2**40, 2**31, 2**32 - 1, 1 << 26, 0)
START = 1_790_000_000_000_000_000  # ns
SAMPLES = 385  # of a valid recording: the wrenches up to the last axis state


def valid(path: Path, chunked: bool, compression: CompressionType, count: int = 400) -> bytes:
    """The bytes of an insertion of ``count`` wrenches."""
    with open(path, "wb") as file:
        writer = Writer(file, use_chunking=chunked, compression=compression, chunk_size=8000)
        writer.start("ros2", "damaged_files")
        writer.add_metadata("needleforce", {"axial": "fz", "filter_length": "50"})
        channels = []
        for topic, name in (("wrench", ros_messages.WRENCH_STAMPED), ("axis", ros_messages.JOINT_STATE),
                            ("marks", ros_messages.STRING)):  # fmt: skip
            schema = writer.register_schema(name, "ros2msg", ros_messages.schema_text(name).encode())
            channels.append(writer.register_channel(f"/needle/{topic}", "cdr", schema))
        bias = ros_messages.string_message('{"kind": "bias", "wrench": [0, 0, 0.1, 0, 0, 0]}')
        writer.add_message(channels[2], START, bias, START, 0)
        for number in range(count):
            at = number * 1_000_000
            data = ros_messages.wrench_message(START + at, (0.0, 0.0, 1e-3 * number, 0.0, 0.0, 0.0))
            writer.add_message(channels[0], START + at + number % 7 * 10_000, data, at, number)
            if number % 16 == 0:
                data = ros_messages.state_message(START + at, 1e-5 * number, 1e-2)
                writer.add_message(channels[1], START + at, data, at, number // 16)
        writer.finish()
    return path.read_bytes()


def damaged(content: bytes, chance: random.Random) -> bytes:
    """``content`` with one to four random changes."""
    data = bytearray(content)
    for _ in range(chance.randint(1, 4)):
        at, piece = chance.randrange(len(data)), chance.randint(1, 200)
        match chance.randrange(7):
            case 0:
                data[at] = chance.randrange(256)
            case 1:
                data[at] ^= 1 << chance.randrange(8)
            case 2:
                del data[at : at + min(piece, len(data) - 20)]
            case 3:
                data[at:at] = data[at : at + piece]
            case 4:
                del data[max(at, 20) :]
            case 5:
                other = chance.randrange(len(data))
                data[at : at + piece] = data[other : other + piece]
            case 6:
                at = _length_of_a_record(data, chance) if chance.random() < 0.8 else at
                data[at : at + 8] = struct.pack("<Q", chance.choice(HUGE))
    return bytes(data)


def _length_of_a_record(data: bytes, chance: random.Random) -> int:
    """The position of the length field of one of the records."""
    places, at = [], 8
    while at + 9 <= len(data) and len(places) < 500:
        places.append(at + 1)
        at += 9 + struct.unpack_from("<Q", data, at + 1)[0]
    return chance.choice(places or [0])


def outcome(path: Path, samples: int) -> str:
    """How a damaged file was read: completely (with at least ``samples`` samples), in part, or refused."""
    try:
        recording = read(path)
    except nf.InputError:
        return "refused"
    problems = {"damaged", "cut_off", "incomplete", "left_out", "lost"} & {note.kind for note in recording.notes}
    return "read completely" if len(recording) >= samples and not problems else "read in part"


def study(files: int, seed: int = 1) -> dict[str, float]:
    """Counts of outcomes over damaged ``files``, worst time as a ratio to a valid file's, peak memory [MB]."""
    chance, counts = random.Random(seed), {"read completely": 0, "read in part": 0, "refused": 0}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        contents = [valid(path, *form) for form in FORMS]
        usual = _valid_time(path, contents)
        before, worst = _peak(), 0.0
        for number in range(files):
            path.write_bytes(damaged(contents[number % len(contents)], chance))
            begun = time.process_time()
            counts[outcome(path, SAMPLES)] += 1
            worst = max(worst, time.process_time() - begun)
    return counts | {
        "worst processor time, ratio to a valid file": worst / usual,
        "memory above that of a valid file [MB]": _peak() - before,
    }


def _valid_time(path: Path, contents: list[bytes]) -> float:
    times = []
    for content in contents * 5:
        path.write_bytes(content)
        begun = time.process_time()
        assert outcome(path, SAMPLES) == "read completely"
        times.append(time.process_time() - begun)
    return sorted(times)[len(times) // 2]


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=10_000)
    warnings.simplefilter("error")
    for what, value in study(parser.parse_args().files).items():
        print(f"{value:12.4g}  {what}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
