# SPDX-License-Identifier: Apache-2.0
"""The commands with hostile files, names, terminals and streams: a message and an exit code, never a traceback."""

import json
import os
import re
import shutil
import subprocess
import sys

import command_line
import numpy as np
import pytest
from command_line import HANGS_S

COMMAND = [sys.executable, "-c", "from needleforce.cli import main; main()"]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="pipes, devices and names of POSIX")


def run(*arguments, cwd=None):
    """Run a command; one that waits for ever fails by its time."""
    done = command_line.run(*arguments, cwd=cwd)
    assert "Traceback" not in done.stderr + done.stdout, done.stderr
    return done


def start(*arguments, environment=None, **options):
    """The same in a process of its own from its first import to its end."""
    done = subprocess.run(
        [*COMMAND, *arguments],
        stdin=subprocess.DEVNULL,
        timeout=HANGS_S,
        env=os.environ | (environment or {}),
        **options,
    )
    assert b"Traceback" not in (done.stderr or b"") + (done.stdout or b""), done.stderr
    assert b"Exception ignored" not in (done.stderr or b"")
    return done


# every option and argument that takes a file to read, in a command that is complete but for the file
FILES = {
    "read": ("identify", "{file}"),
    "needle": ("identify", "{example}", "--needle", "{file}"),
    "model": ("identify", "{example}", "--model", "{file}.toml"),
    "second": ("identify", "{example}", "--second-pass", "{file}"),
    "motion": ("identify", "{example}", "--motion", "{file}"),
    "bending": ("identify", "{example}", "--needle", "paper", "--bending", "{file}"),
    "tension": ("identify", "{example}", "--tension", "{file}"),
    "campaign": ("campaign", "{file}"),
    "mapping": ("campaign", "{example}", "--mapping", "{file}"),
    "campaign needle": ("campaign", "{example}", "--needle", "{file}"),
    "compare": ("compare", "{file}"),
    "convert": ("convert", "{file}", "-o", "out.csv"),
    "convert motion": ("convert", "{example}", "--motion", "{file}", "-o", "out.csv"),
    "indentation": ("indentation", "{file}", "--tip", "cone", "--half-angle-deg", "9"),
    "indentation needle": ("indentation", "{example}", "--needle", "{file}"),
    "export": ("export", "{file}.json"),
    "laws": ("laws", "--needle", "{file}"),
    "tissue": ("laws", "--tissue", "{file}"),
    "simulate": ("simulate", "--preset", "{file}.toml", "-o", "out.csv"),
    "rest": ("rest", "--mass-g", "100", "--damping-ns-m", "1", "--preset", "{file}.json"),
    "rig": ("rig", "--preset", "{file}.toml", "--duration-s", "0"),
    "page": ("record", "--sensor", "127.0.0.1", "--sensor-page", "{file}", "-o", "out.mcap", "--duration-s", "0.1"),
    "protocol": ("record", "--sensor", "127.0.0.1", "--axis", "127.0.0.1", "--protocol", "{file}", "--folder", "out"),
    "calibration": ("record", "--from", "-", "--calibration", "{file}.xml", "-o", "out.mcap"),
}
REFUSED = {"pipe": "a pipe", "zero": "a device"}


@pytest.fixture(scope="module")
def place(tmp_path_factory, root):
    """A folder with pipes and devices, each under every ending."""
    folder = tmp_path_factory.mktemp("special")
    shutil.copy(root / "examples" / "insertion.csv", folder / "example.csv")
    for ending in ("", ".toml", ".json", ".xml"):
        os.mkfifo(folder / f"pipe{ending}")
        (folder / f"zero{ending}").symlink_to("/dev/zero")
    return folder


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize("option", FILES)
def test_no_command_opens_a_pipe_or_a_device(place, option, kind):
    arguments = [word.format(file=kind, example="example.csv") for word in FILES[option]]
    done = run(*arguments, cwd=place)
    text = done.stderr
    assert done.returncode != 0 or (option == "second" and REFUSED[kind] in text), text
    assert REFUSED[kind] in text or "not a file" in text, text
    assert not list(place.glob("out*"))


def copied(root, path: bytes) -> None:
    """The example under another name, with noise of its own: the same readings twice are refused."""
    lines = (root / "examples" / "insertion.csv").read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    random, force = np.random.default_rng(list(path)), lines[head].split(",").index("force_N")
    rows = [line.split(",") for line in lines[head + 1 :]]
    for cells in rows:
        cells[force] = f"{float(cells[force]) + 2e-3 * random.normal():.6f}"
    with open(path, "w") as file:
        file.write("\n".join([*lines[: head + 1], *(",".join(cells) for cells in rows)]) + "\n")


def test_a_file_whose_name_is_not_utf_8_is_a_recording_like_others(tmp_path, root):
    names = [b"run_1.csv", b"run_\xff.csv", b"run_3.csv"]
    for name in names:
        copied(root, os.path.join(os.fsencode(tmp_path), name))
    pytest.importorskip("pyarrow")
    for table in ("out/table.csv", "out/table.parquet"):
        (tmp_path / "out").mkdir(exist_ok=True)
        done = run("campaign", ".", "--pattern", "run_{repeat}", "--table", table, "--json", "out/x.json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    assert r"run_\xff.csv" in (tmp_path / "out/table.csv").read_text()
    for output in ("out.mcap", "out.parquet", "out.csv"):
        done = run("convert", names[1], "-o", output, cwd=os.fsencode(tmp_path))
        assert done.returncode == 0 and done.stderr.isascii(), done.stderr
    done = run(
        "identify", *names, "--json", "-", "--report", "out/r.html", "--csv", "out/x.csv", cwd=os.fsencode(tmp_path)
    )
    assert done.returncode == 0 and len(json.loads(done.stdout)["recordings"]) == 3


def test_a_specimen_named_like_a_formula_is_text_in_the_table(tmp_path, root):
    import pandas

    for repeat in (1, 2):
        copied(root, os.fsencode(tmp_path / f"=HYPERLINK(1)_{repeat}.csv"))
    done = run("campaign", ".", "--pattern", "{specimen}_{repeat}", "--table", "t.csv", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    table = pandas.read_csv(tmp_path / "t.csv", keep_default_na=False)
    assert set(table["specimen"]) == {"'=HYPERLINK(1)"}
    done = run(
        "identify", "=HYPERLINK(1)_1.csv", "=HYPERLINK(1)_2.csv", "--csv", "e.csv", "--draws", "d.csv", cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    for name in ("t.csv", "e.csv", "d.csv"):
        frame = pandas.read_csv(tmp_path / name, dtype=str, keep_default_na=False)
        assert not [cell for cell in frame.to_numpy().ravel() if cell[:1] in ("=", "+", "@")]


def test_no_text_of_a_file_reaches_the_terminal_as_a_command(tmp_path):
    name = "x\x1b]0;owned\x07\x1b[2J\u202e.csv"
    (tmp_path / name).write_text("time_s,\x1b[31mdepth,\x9bforce_N\n0,0,\x1b[2Jx\n")
    (tmp_path / "x.toml").write_text('name = "\x9b2J"\n')
    (tmp_path / "y.toml").write_bytes(b"[\x1b[2J]\n")
    commands = [
        ("identify", name),
        ("campaign", "."),
        ("convert", name, "-o", "y.csv"),
        ("export", "x.toml"),
        ("export", "y.toml"),
    ]
    for arguments in commands:
        done = run(*arguments, cwd=tmp_path)
        shown = done.stdout + done.stderr
        assert done.returncode and not [
            each for each in shown if (each < " " and each not in "\n\t") or each in "\x7f\x9b\u202e"
        ], shown


@pytest.mark.parametrize(
    "arguments, how",
    [
        (("laws",), (">&-", "2>&-", ">&- 2>&-", ">&- <&-")),
        (("presets", "--json", "-"), (">&-",)),
        (("export", "paper"), (">&- 2>&-",)),
    ],
    ids=lambda given: given[0],
)
def test_a_closed_standard_output_or_error(arguments, how):
    for closed in how:
        shell = f'"$@" {closed}'
        done = subprocess.run(["sh", "-c", shell, "sh", *COMMAND, *arguments], capture_output=True, timeout=HANGS_S)
        assert done.returncode == 0 and b"Traceback" not in done.stderr + done.stdout


def test_a_reader_that_leaves_and_a_full_disk():
    done = subprocess.run(["sh", "-c", '"$@" | head -1', "sh", *COMMAND, "laws"], capture_output=True, timeout=HANGS_S)
    assert done.stderr == b""
    with open("/dev/full", "w") as full:
        done = start("laws", stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 1 and b"No space left on device" in done.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ("laws", "--citations"),
        ("presets",),
        ("compare", "{example}", "--models", "paper"),
        ("identify", "{example}"),
        ("simulate", "--citations", "-o", "{out}"),
    ],
)
def test_a_terminal_that_knows_only_ascii(arguments, root, tmp_path):
    environment = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONIOENCODING": "ascii"}
    places = {"example": root / "examples" / "insertion.csv", "out": tmp_path / "out.csv"}
    done = start(*(word.format(**places) for word in arguments), environment=environment, capture_output=True)
    assert done.returncode == 0 and done.stdout.isascii() and done.stderr.isascii()
    assert b"\\" not in done.stdout + done.stderr
    for table in re.findall(rb"(?:^[+|].*\n)+", done.stdout, re.M):
        assert len(set(map(len, table.splitlines()))) == 1, table.decode()


# the outputs of a command, the first of which meets a full disk
OUTPUTS = {
    "identify": ["--json o.json", "--report o.html", "--save o.toml", "--csv o.csv", "--draws d.csv"],
    "compare": ["--json o.json", "--report o.html"],
    "penetration": ["--json o.json", "--table o.csv", "--report o.html"],
    "campaign": ["--table o.csv", "--json o.json", "--report o.html"],
}


@pytest.mark.parametrize("command", OUTPUTS)
def test_a_full_disk_loses_one_output(command, root, tmp_path, monkeypatch):
    import errno

    from typer.testing import CliRunner

    from needleforce.cli import app

    words = " ".join(OUTPUTS[command]).split()
    lost, *kept = words[1::2]
    replace = os.replace

    def full(source, target):
        if os.path.basename(target) == lost:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr(os, "replace", full)
    monkeypatch.chdir(tmp_path)
    models = ["--models", "paper"] if command == "compare" else []
    done = CliRunner().invoke(app, [command, str(root / "examples" / "insertion.csv"), *models, *words])
    assert done.exit_code == 2 and f"{lost}: file is not written, No space left on device" in done.stderr
    assert [name for name in kept if not os.path.getsize(name)] == [] and not os.path.exists(lost)


@pytest.mark.parametrize(
    "arguments",
    [
        ("simulate", "-o", "x.csv", "--depth-mm", "1_0"), ("simulate", "-o", "x.csv", "--rate-hz=1_000"),
        ("demo", "--seed", "1_0"), ("indentation", "x.csv", "--tip", "cone", "--half-angle-deg", "1_5"),
        ("identify", "x.csv", "--layers", "0_2"), ("identify", "x.csv", "--speed-mm-s", "1_0"),
        ("penetration", "x.csv", "--plateau-mm", "1_0:20"), ("rig", "--duration-s", "1_0"),
    ],
)  # fmt: skip
def test_a_number_with_underscores_is_none(tmp_path, arguments):
    assert re.search(r"is '1_\S*|is '0_2'", (done := run(*arguments, cwd=tmp_path)).stderr), done.stderr
    assert done.returncode == 2 and not (tmp_path / "x.csv").exists()
