# SPDX-License-Identifier: Apache-2.0
"""``needleforce rig`` as a process: its printed ports, its end, invalid options."""

import re
import signal
import socket
import subprocess
import sys

import pytest

COMMAND = [sys.executable, "-c", "from needleforce.cli import main; main()", "rig"]
FREE = ["--sensor-port", "0", "--axis-port", "0", "--page-port", "0"]


def test_it_prints_its_ports_and_ends_with_ctrl_c():
    with subprocess.Popen([*COMMAND, *FREE], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            ready = process.stdout.readline()
            ports = re.match(
                r"ready: sensor 127\.0\.0\.1:(\d+), axis 127\.0\.0\.1:(\d+), page http://127\.0\.0\.1:(\d+)/netftapi2\.xml$",
                ready,
            )
            with socket.create_connection(("127.0.0.1", int(ports[2])), 600.0) as axis, axis.makefile() as lines:
                assert lines.readline().startswith("axis ")
                axis.sendall(b"move 0.001 0.003\n")
                assert any(line == "ok move\n" for line in lines)
                process.send_signal(signal.SIGINT)
                out, err = process.communicate(timeout=6000)
        finally:
            process.kill()
    assert process.returncode == 0 and err == ""
    assert "connected\n" in out and "axis: move 0.001 0.003: ok move\n" in out and "Traceback" not in out


def test_it_ends_after_its_duration():
    done = subprocess.run([*COMMAND, *FREE, "--duration-s", "0.2"], capture_output=True, text=True, timeout=600)
    assert done.returncode == 0 and done.stdout.startswith("ready: ")


@pytest.mark.parametrize(
    "options, message",
    [
        (["--fault", "gone=1"], "Give one of lost, "),
        (["--fault", "lost=2"], "fault lost is 2.0, outside 0 to 1"),
        (["--fault", "lost"], "Write it as lost=0.05"),
        (["--seed", "-1"], "seed"),
        (["--preset", "none_such"], "none_such"),
        (["--axis-port", "70000"], "--axis-port is 70000, outside 0 to 65535"),
        (["--filter-length", "0"], "filter_length"),
    ],
)
def test_invalid_options_exit_with_2(options, message, monkeypatch, capsys):
    from needleforce.cli import main

    monkeypatch.setattr(sys, "argv", ["needleforce", "rig", *FREE, *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2 and message in capsys.readouterr().err
