# SPDX-License-Identifier: Apache-2.0
"""The pages on the rig, live recording, protocols and the live file: their code runs and agrees with the program."""

import contextlib
import dataclasses
import inspect
import io
import re
import shlex
import subprocess
import sys

import pytest
import typer
from fake_rig import CONFIGURATION, FakeAxis, FakeSensor

from needleforce.acquisition import run_writer
from needleforce.acquisition.motion_sequence import EndReason
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.gauge_calibration import read_calibration
from needleforce.acquisition.sources.opening import DEFAULT_LIMIT_SHARE
from needleforce.acquisition.sources.reading_checks import LATE_WINDOW
from needleforce.acquisition.sources.standard_input import StandardInput
from needleforce.cli import app
from needleforce.commands import record, rig
from needleforce.protocol.folder import MAX_UNRECORDED_S, SURFACE_MARGIN_M
from needleforce.recording.log import LogWriter
from needleforce.recording.log.mcap_records import MAX_RECORD_BYTES
from needleforce.rig.live.axis import LIMITS
from needleforce.rig.live.sensor import READINGS_PER_RECORD, RECORDS_PER_DATAGRAM
from needleforce.wire.axis_lines import MAX_LINE_LENGTH, MAX_SILENCE_S, STATE_RATE_HZ, range_line
from needleforce.wire.net_ft import Command

PAGES = ("rig", "recording_live", "protocols", "live_file")
COMMANDS = typer.main.get_command(app).commands


@pytest.fixture
def page(root):
    folder = root / "docs" / "reference"
    return lambda name: (folder / f"{name}.md").read_text(encoding="utf-8").replace("\\\n", " ")


@pytest.fixture
def source(root):
    """Source code of the recorder."""
    files = sorted((root / "src" / "needleforce" / "acquisition").glob("*.py"))
    return "".join(path.read_text(encoding="utf-8") for path in files)


def block(text: str, word: str, language: str = "python") -> str:
    """The one code block that contains a word."""
    (found,) = [each for each in re.findall(rf"```{language}\n(.*?)```", text, re.S) if word in each]
    return found


def output_of(code: str) -> str:
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(code, {})
    return out.getvalue()


def first_column(text: str, heading: str) -> set[str]:
    """The words in code style in the first column of a table."""
    table = text.split(heading, 1)[1].split("\n\n", 1)[0]
    return {word for row in table.splitlines()[2:] for word in re.findall("`([^`]+)`", row.split("|")[1])}


@pytest.mark.parametrize("name", PAGES)
def test_options_exist(page, name):
    known = {
        option
        for command in COMMANDS.values()
        for param in command.params
        for option in (*param.opts, *param.secondary_opts)
    }
    assert set(re.findall(r"(?<![\w-])--[a-zA-Z][\w-]+", page(name))) <= known


@pytest.mark.parametrize("name", PAGES)
def test_command_lines_are_valid(page, name):
    lines = re.findall(r"^    (?:.*\| )?needleforce (.*)", page(name), re.M)
    assert lines
    for line in lines:
        command, *arguments = shlex.split(line, comments=True)
        with COMMANDS[command].make_context(command, arguments):
            pass


def test_defaults_of_the_command_are_those_of_the_settings():
    defaults = {name: each.default for name, each in inspect.signature(record.run).parameters.items()}
    usual = {field.name: field.default for field in dataclasses.fields(Settings)}
    names = {"bias_s": "bias_time", "steady_n": "steady", "axial": "axial", "filter_length": "filter_length"}
    assert {name: defaults[name] for name in names} == {name: usual[field] for name, field in names.items()}


def test_reasons_for_the_end_of_a_run_are_in_the_table(page, source):
    reasons = {reason.value for reason in EndReason}
    assert first_column(page("recording_live"), "| it ends with |") == reasons - {"failed"}
    assert "`failed`" in page("recording_live")
    assert set(re.findall(r"EndReason\.([A-Z_]+)", source)) == set(EndReason.__members__), "each is used"


def test_marks_are_in_the_table(page, source):
    written = set(re.findall(r'mark\("(\w+)"', source)) | set(run_writer.SOURCE_COUNTS)
    assert first_column(page("recording_live"), "| mark |") == written


def test_ports_range_and_requests_of_the_rig(page):
    text = page("rig")
    ports = [inspect.signature(rig.run).parameters[f"{each}_port"].default for each in ("sensor", "axis", "page")]
    assert ", ".join(map(str, ports)) in text and f":{ports[2]}/" in text
    assert range_line(LIMITS).removeprefix("axis ") in text
    assert {int(code, 0) for code in re.findall(r"0x1234, `uint16` (\w+)", text)} == set(Command)


@pytest.mark.parametrize(
    "name, figure",
    [
        ("recording_live", f"flushed every {Settings.flush_every:g} s"),
        ("recording_live", f"by up to {LATE_WINDOW} records"),
        ("recording_live", f"{DEFAULT_LIMIT_SHARE:g} of the sensor's rating"),
        (
            "protocols",
            f"in the {MAX_UNRECORDED_S:g} s until its axis stops by itself, is within {1e3 * SURFACE_MARGIN_M:g} mm",
        ),
        ("rig", f"nothing for {MAX_SILENCE_S:g} s"),
        ("rig", f"more than {MAX_LINE_LENGTH} characters"),
        ("rig", f"{STATE_RATE_HZ:g} times a second"),
        ("rig", f"{RECORDS_PER_DATAGRAM} records in a datagram"),
        ("rig", f"{READINGS_PER_RECORD} for each record"),
        ("live_file", f"No record over {MAX_RECORD_BYTES >> 20} MiB"),
    ],
)
def test_figures_are_those_of_the_program(page, name, figure):
    assert figure in page(name)


def test_the_python_example_of_the_virtual_rig_runs(page):
    ports = output_of(block(page("rig"), "VirtualRig")).split()
    assert len(set(ports)) == 3 and all(1024 <= int(port) < 65536 for port in ports)


@pytest.mark.usefixtures("simulated_time")
def test_the_python_example_of_a_recording_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "page.xml").write_bytes(CONFIGURATION.xml())
    with FakeSensor() as sensor, FakeAxis() as axis:
        code = block(page("recording_live"), "record_run")
        for shown, here in (
            ('SensorClient("192.168.1.1"', f'SensorClient("127.0.0.1", {sensor.port}'),
            ('read_configuration("192.168.1.1")', 'read_configuration("127.0.0.1", "page.xml")'),
            ('AxisClient("192.168.1.2"', f'AxisClient("127.0.0.1", {axis.port}'),
            ("3e-3", "45e-3"),  # the same, faster
            ("5.0", "0.05"),
        ):
            assert shown in code
            code = code.replace(shown, here)
        names = {}
        exec(code, names)
    assert names["outcome"].ended == "done" and (tmp_path / "run.mcap").stat().st_size > 1000
    assert [line.split()[1] for line in axis.received if line.startswith("move")] == ["0.01600000", "-0.00500000"]


def test_the_python_example_of_a_plan_runs(page):
    lines = output_of(block(page("protocols"), "plan(")).splitlines()
    assert len(lines) == 2 * 5 * 2  # speeds, sites, passes
    assert lines[0].startswith("3mm_s_site1_pass1.mcap ((0.016, 0.003), ")


def test_the_example_of_a_program_as_a_sensor_runs(page, tmp_path):
    code = block(page("protocols"), "my_card")
    assert len([line for line in code.splitlines() if line]) <= 10
    (tmp_path / "program.py").write_text(code, encoding="utf-8")
    card = "left = [[0, 0, k, 0, 0, 0] for k in range(30)]\nread_six_newtons = lambda: left.pop(0)\n"
    (tmp_path / "my_card.py").write_text(card, encoding="utf-8")
    program = [sys.executable, str(tmp_path / "program.py")]
    with subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as running:
        lines, samples = StandardInput(running.stdout), []
        lines.start()
        with pytest.raises(EOFError):
            while True:
                samples += lines.receive(10.0)
    assert [(each.sequence, each.wrench[2]) for each in samples] == [(k, k) for k in range(30)]


def test_the_example_of_a_calibration_is_read(page, tmp_path):
    (tmp_path / "gauges.toml").write_text(block(page("protocols"), "force_unit", "toml"), encoding="utf-8")
    made = read_calibration(tmp_path / "gauges.toml")
    assert made.serial == "FT12345" and made.ratings == pytest.approx((25, 25, 35, 0.25, 0.25, 0.25))


def test_the_example_that_reads_the_file_without_this_package_runs(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = LogWriter("run.mcap", {})
    log.wrench(7, 1000, 2000, 1500, [1.0] * 6)
    log.state(8, 1000, 2000, 1500, 0.0, 0.0)
    log.close({})
    number, arrival, device, size = map(int, output_of(block(page("live_file"), "make_reader")).split())
    assert (number, arrival, device) == (7, 1000, 2000)
    # encoding 4, time 8, length of the frame 4, "needle" and its zero 7, to a multiple of 8 behind the encoding 5, 48
    assert size == 4 + 8 + 4 + 7 + 5 + 48
