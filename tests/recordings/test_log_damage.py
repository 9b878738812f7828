# SPDX-License-Identifier: Apache-2.0
"""Truncated, damaged and malicious files."""

import io
import random
import runpy
import struct
import subprocess
import sys
import zlib

import lz4.frame
import plain_log
import pytest
import zstandard
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.reader import NonSeekingReader
from mcap.records import Chunk

import needleforce as nf
from needleforce.recording.log import read_log

MAGIC = b"\x89MCAP0\r\n"


@pytest.fixture(scope="module")
def bench(root):
    return runpy.run_path(str(root / "benchmarks" / "damaged_files.py"))


def records(content: bytes):
    """Offset, operation code and length of each record of a valid file, parsed from the format."""
    at = len(MAGIC)
    while at + 9 <= len(content) - len(MAGIC):
        code, length = struct.unpack_from("<BQ", content, at)
        yield at, code, length
        at += 9 + length


def counts(content: bytes) -> int:
    """The number of wrenches in the chunks and messages of ``content``, by another reader."""
    reader = NonSeekingReader(io.BytesIO(content))
    return sum(1 for _, channel, _ in reader.iter_messages() if channel.topic == "/needle/wrench")


@pytest.mark.parametrize("form", range(4))
def test_a_truncated_file_is_read_up_to_its_last_complete_record(bench, tmp_path, form):
    content = bench["valid"](tmp_path / "whole.mcap", *bench["FORMS"][form], count=200)
    places = list(records(content))
    ends = [at + 9 + length for at, _, length in places]
    footer = next(at for at, code, _ in places if code == 2)
    path, chance = tmp_path / "cut.mcap", random.Random(form)
    for cut in [*range(8, 40), *chance.choices(range(8, len(content)), k=120)]:
        path.write_bytes(content[:cut])
        log = read_log(path)
        last = max((end for end in ends if end <= min(cut, footer)), default=8)
        # the same records, closed properly by a footer, through the other reader
        closed = content[:last] + struct.pack("<BQQQI", 2, 20, 0, 0, 0) + MAGIC
        assert len(log.wrench) == counts(closed)
        assert log.complete == (cut >= footer + 9)


def test_a_file_shorter_than_the_magic_bytes_is_refused(tmp_path):
    path = tmp_path / "run.mcap"
    for cut in range(8):
        path.write_bytes(MAGIC[:cut])
        with pytest.raises(nf.InputError, match="not an MCAP file"):
            read_log(path)


def test_a_damaged_chunk_is_left_out_and_the_rest_is_read(tmp_path):
    path = tmp_path / "run.mcap"
    plain_log.write(path, count=500, flush=100)
    content = bytearray(path.read_bytes())
    chunks = [(at, length) for at, code, length in records(bytes(content)) if code == 6]
    assert len(chunks) == 5
    at, length = chunks[0]  # it also contains the definitions of all topics
    content[at + 9 + length - 10] ^= 0xFF
    path.write_bytes(content)
    log = read_log(path)
    assert log.wrench.sequence.tolist() == list(range(100, 500))
    note = next(note for note in log.notes if note.kind == "damaged")
    assert note.count == length and log.complete


def test_random_damage_is_read_in_part_or_refused(bench):
    found = bench["study"](400, seed=7)
    assert sum(found[key] for key in ("read completely", "read in part", "refused")) == 400
    assert found["read in part"] > 100
    assert found["memory above that of a valid file [MB]"] < 300


def chunk(data: bytes, compression: str, size: int, crc: int = 0) -> bytes:
    builder = RecordBuilder()
    Chunk(compression, data, 0, 0, crc, size).write(builder)
    return builder.end()


def lz4_of_zeros(size: int) -> bytes:
    compressor = lz4.frame.LZ4FrameCompressor()
    parts = [compressor.begin()] + [compressor.compress(bytes(1 << 20)) for _ in range(size >> 20)]
    return b"".join([*parts, compressor.flush()])


def zstd_of(piece: bytes, size: int) -> bytes:
    data = piece * (size // len(piece))
    return chunk(zstandard.compress(data), "zstd", len(data))


def zstd_of_zeros(size: int, declared: bool) -> bytes:
    compressor = zstandard.ZstdCompressor(write_content_size=declared).compressobj(size if declared else -1)
    return b"".join([*(compressor.compress(bytes(1 << 20)) for _ in range(size >> 20)), compressor.flush()])


GIB = 1 << 30
HARM = {
    "zstd says little": lambda: chunk(zstd_of_zeros(GIB, True), "zstd", 1000),
    "zstd says nothing": lambda: chunk(zstd_of_zeros(GIB, False), "zstd", 1000),
    "zstd says much": lambda: chunk(zstd_of_zeros(GIB, True), "zstd", GIB),
    "zstd says the most": lambda: chunk(zstd_of_zeros(64 << 20, True), "zstd", 64 << 20) * 40,
    "messages of no channel": lambda: zstd_of(struct.pack("<BQHIQQ", 5, 22, 7, 0, 0, 0), 16 << 20),
    "definitions without end": lambda: zstd_of(struct.pack("<BQH", 3, 14, 9) + bytes(12), 16 << 20) + b"\0",
    "lz4 says little": lambda: chunk(lz4_of_zeros(GIB), "lz4", 1000),
    "lz4 says much": lambda: chunk(lz4_of_zeros(GIB), "lz4", 2**63),
    "plain says much": lambda: chunk(b"abc", "", 2**64 - 1),
    "a record without end": lambda: struct.pack("<BQ", 5, 2**64 - 1) + b"abc",
    "an unknown way": lambda: chunk(b"abc", "brotli", 3),
    "no chunk": lambda: struct.pack("<BQ", 6, 3) + b"abc",
}


@pytest.mark.parametrize("harm", HARM)
def test_malicious_files_use_little_memory(tmp_path, harm):
    path = tmp_path / "harm.mcap"
    path.write_bytes(MAGIC + HARM[harm]() + MAGIC)
    code = """
import resource, sys
import lz4.frame, mcap.records, zstandard
from needleforce.recording.log import read_log
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
log = read_log(sys.argv[1])
print(len(log.wrench), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, len(log.notes))
"""
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    wrenches, grown, notes = map(int, done.stdout.split())
    assert wrenches == 0 and notes > 0
    assert grown < 220 * 1024  # kB: the largest record three times over


def test_a_chunk_with_a_correct_checksum_is_read(tmp_path):
    """The files above are refused for their faults, not because a test wrote them."""
    path = tmp_path / "run.mcap"
    plain_log.write(path)
    content = path.read_bytes()
    at, _, length = next(each for each in records(content) if each[1] == 6)
    first = Chunk.read(ReadDataStream(io.BytesIO(content[at + 9 : at + 9 + length])))
    data = zstandard.decompress(first.data, first.uncompressed_size)
    ways = {"": data, "lz4": lz4.frame.compress(data), "zstd": zstandard.compress(data)}
    for compression, packed in ways.items():
        made = chunk(packed, compression, len(data), zlib.crc32(data))
        path.write_bytes(MAGIC + made)
        assert len(read_log(path).wrench) == 100
