# SPDX-License-Identifier: Apache-2.0
"""The rig over the loopback network, in real time: packet losses, killed recorders, the force limit, damaged packets.

``python benchmarks/rig.py writer stream kills limit packets``, one or several; ``--quick`` is a tenth of each. The
paper's campaign is in ``rig_campaign.py``.
"""

import argparse
import os
import random
import resource
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np
from rig_process import rig

import needleforce as nf
from needleforce.acquisition.recorder import record_run
from needleforce.acquisition.settings import Settings
from needleforce.acquisition.sources.axis import AxisClient
from needleforce.acquisition.sources.net_ft_sensor import SensorClient, read_configuration
from needleforce.recording.log import LogWriter, read_log

FAULTS = {
    "lost": 0.05, "reordered": 0.02, "duplicated": 0.01, "late": 0.01, "sensor_drift_ppm": 80.0,
    "axis_drift_ppm": -50.0, "clock_offset_s": 1000.0,
}  # fmt: skip
HERE = "127.0.0.1"
PAPER = ("puncture_force", "puncture_indentation", "friction_per_length", "cutting_force")


def sources(made):
    """A client of each of the rig's streams."""
    page = f"http://{HERE}:{made.page}/netftapi2.xml"
    return SensorClient(HERE, made.sensor, read_configuration(HERE, page)), AxisClient(HERE, made.axis)


def insertion(speed: float, depth: float, hold: float = 1.0, start: float = -4e-3) -> list[tuple[float, float]]:
    """The moves of one insertion."""
    return [(start, 10e-3), (start, 0.5), (depth, speed), (depth, hold), (start, speed), (start, 0.5)]


def stream(folder: Path, quick: bool):
    """About 60 s at 1 kHz, two passes, without and with faults: losses, and identified parameters."""
    fits = {}
    for name, faults in (("no faults", {}), ("faults", FAULTS)):
        with rig(seed=3, faults=faults) as made:
            passes = []
            for number, depth in ((1, 16e-3), (2, 15.7e-3)):
                path = folder / f"{name.replace(' ', '_')}_{number}.mcap"
                moves = insertion(3e-3, depth, hold=1.0 if quick else 44.0)  # at 1 mm/s the cutting force oscillates
                outcome = record_run(path, *sources(made), moves, {}, Settings(2.0, filter_length=10))
                yield counted(f"{name}, pass {number}", outcome, made.truth()["streams"][-1], path)
                passes.append(nf.read(path))
            fits[name] = nf.identify(
                passes[:1], second_pass=passes[1:], model="paper", needle=nf.preset("paper").needle
            )
    for quantity in PAPER:
        clean, faulty = (fits[name].parameters[quantity] for name in ("no faults", "faults"))
        half = 0.5 * np.hypot(clean.high - clean.low, faulty.high - faulty.low)
        text = f"{clean.value:.5g} ({clean.low:.5g} to {clean.high:.5g}) | {faulty.value:.5g}"
        text += f" ({faulty.low:.5g} to {faulty.high:.5g}) {clean.unit}; difference "
        text += f"{abs(faulty.value - clean.value) / half:.2f} half intervals"
        yield f"{quantity}, no faults | faults", text


def counted(name: str, outcome, ledger: dict, path: Path) -> tuple[str, str]:
    """The recorder's counts compared with the rig's, up to the newest record received."""
    log = read_log(path)
    newest = int(log.wrench.sequence[-1])
    lost = sum(number <= newest for number in ledger["lost"])
    missing = set(range(int(log.wrench.sequence[0]), newest + 1)) - set(log.wrench.sequence.tolist())
    same = missing <= set(ledger["lost"])
    text = f"{outcome.seconds:.1f} s, {outcome.received} received; lost {outcome.lost} (rig: {lost}, same records: "
    text += f"{same}), duplicated {outcome.duplicated} (rig: {len(ledger['duplicated'])}), late {outcome.late}; "
    text += f"longest own gap {1e3 * outcome.longest_own_gap:.1f} ms, "
    text += f"{100 * outcome.cpu_share:.1f} % of a processor, clock uncertainty "
    return name, text + f"{1e3 * outcome.alignment_uncertainty:.3f} ms"


def kills(folder: Path, quick: bool):
    """Recorders killed at random moments: time span of the readings that had arrived but are not in the file."""
    draw, missing, read = random.Random(1), [], 0
    count = 20 if quick else 200
    command = [str(Path(sys.executable).with_name("needleforce")), "record"]
    with rig(seed=1) as made:
        for number in range(count):
            path = folder / f"killed_{number}.mcap"
            options = [*made.arguments(), "-o", str(path), "--depth-mm", "16", "--speed-mm-s", "10", "--bias-s", "0.1"]
            process = subprocess.Popen([*command, *options], stderr=subprocess.DEVNULL)
            while not path.exists():
                time.sleep(0.01)
            time.sleep(draw.uniform(0.0, 2.0))
            process.send_signal(signal.SIGKILL)
            killed = time.time_ns()
            process.wait()
            log = read_log(path)
            read += 1
            missing.append(1e-6 * (killed - int(log.wrench.arrival[-1])) if len(log.wrench) else np.nan)
            path.unlink()
            time.sleep(0.7)  # without a client the axis stops by itself and accepts a new one
    missing = np.array(missing)
    empty = int(np.isnan(missing).sum())
    text = f"{read} of {count} files read; not kept: median {np.nanmedian(missing):.0f} ms, "
    text += f"worst {np.nanmax(missing):.0f} ms"
    yield "kills", f"{text}; {empty} killed before the first flush"


def limit(folder: Path, quick: bool):
    """Stops on a force limit: delays until braking and until rest, force and travel beyond the limit."""
    rows = []
    with rig(seed=5) as made:
        for number in range(10 if quick else 100):
            path = folder / f"limit_{number}.mcap"
            sensor, axis = sources(made)
            axis.site(number + 1)
            begun = made.truth(1e9)["now"]
            outcome = record_run(path, sensor, axis, insertion(10e-3, 16e-3), {}, Settings(0.15, bias_time=0.2))
            assert outcome.ended == "force limit", outcome
            rows.append(overshoot(made.truth(begun), read_log(path), outcome))
            path.unlink()
            withdraw(made)
    rows = np.array(rows)
    quantities = (
        ("until the axis begins to brake", "ms"),
        ("until the needle rests", "ms"),
        ("force above the limit", "N"),
        ("travel beyond the limit", "mm"),
    )
    for column, (name, unit) in enumerate(quantities):
        values = rows[:, column]
        text = f"median {np.median(values):.4g}, 95 % {np.percentile(values, 95):.4g}, worst {values.max():.4g} {unit}"
        yield f"force limit, {len(rows)} trials: {name}", text


def overshoot(truth: dict, log, outcome) -> tuple[float, float, float, float]:
    """Delay [ms], time to rest [ms], force [N] and travel [mm] beyond the limit, from the true motion of the needle."""
    time_, depth, force = (np.array(truth[name]) for name in ("time", "depth", "force"))
    crossed = int(np.argmax(force > 0.15))
    at_rest = crossed + int(np.argmax(np.diff(depth[crossed:]) < 1e-7))
    braking = crossed + int(np.argmax(np.diff(depth[crossed:]) < 0.99 * np.diff(depth)[crossed - 5]))
    return (
        1e3 * (time_[braking] - time_[crossed]),
        1e3 * (time_[at_rest] - time_[crossed]),
        float(force[crossed : at_rest + 50].max() - 0.15),
        1e3 * (depth[at_rest] - depth[crossed]),
    )


def withdraw(made) -> None:
    """Move the needle out of the tissue."""
    axis = AxisClient(HERE, made.axis)
    axis.move(-4e-3, 20e-3)
    deadline = time.monotonic() + 10.0
    resting = False
    while not resting and time.monotonic() < deadline:
        axis.alive()
        states = axis.receive()
        resting = bool(states) and states[-1][0].condition == "idle" and abs(states[-1][0].depth + 4e-3) < 1e-4
        time.sleep(0.02)
    axis.close()


def packets(folder: Path, quick: bool):
    """Damaged packets among valid ones: a bit flipped, truncated, extended, or entirely random."""
    count = 10_000 if quick else 100_000
    path, draw = folder / "damaged.mcap", random.Random(2)
    server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    server.bind((HERE, 0))
    server.settimeout(10.0)
    page = Path(folder / "netftapi2.xml")
    page.write_bytes(b"<netft><scfgfu>N</scfgfu><scfgtu>Nm</scfgtu><cfgcpf>1000000</cfgcpf><cfgcpt>1000000</cfgcpt>"
                     b"<comrdtrate>1000</comrdtrate></netft>")  # fmt: skip
    sender = threading.Thread(target=send_damaged, args=(server, count, draw), daemon=True)
    sender.start()
    client = SensorClient(HERE, server.getsockname()[1], read_configuration(HERE, str(page)))
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    begun = time.perf_counter()
    outcome = record_run(path, client, None, [], {}, Settings(np.inf, duration=1e4, steady=np.inf))
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    text = f"{count} damaged: ended '{outcome.ended}', {time.perf_counter() - begun:.1f} s, {outcome.received} kept, "
    text += f"{client.wrong_size} of a wrong size, {client.restart} counter restarts, "
    yield "packets", text + f"memory grew by {grown:.0f} MB, {len(read_log(path).wrench)} read back"


def send_damaged(server: socket.socket, count: int, draw: random.Random) -> None:
    """A valid packet, then ten damaged ones, at a rate that the reader can follow."""
    _, client = server.recvfrom(100)
    for number in range(1000):  # for the bias
        server.sendto(struct.pack(">3I6i", number, 7 * number, 0, *[0] * 6), client)
        time.sleep(5e-4)
    for number in range(1000, 1000 + count // 10):
        valid = struct.pack(">3I6i", number, 7 * number, 0, *[draw.randrange(-1000, 1000) for _ in range(6)])
        server.sendto(valid, client)
        for _ in range(10):
            server.sendto(damaged(valid, draw), client)
        time.sleep(1e-3)


def damaged(packet: bytes, draw: random.Random) -> bytes:
    """The packet with one of four kinds of damage."""
    match draw.randrange(4):
        case 0:
            at = draw.randrange(len(packet))
            return packet[:at] + bytes([packet[at] ^ 1 << draw.randrange(8)]) + packet[at + 1 :]
        case 1:
            return packet[: draw.randrange(len(packet))]
        case 2:
            return packet + os.urandom(draw.randrange(1, 200))
    return os.urandom(draw.randrange(1, 100))


def writer(folder: Path, quick: bool):
    """Time and bytes per wrench in the file, including a flush every quarter of a second."""
    count, draw = (6_000 if quick else 60_000), np.random.default_rng(3)
    wrenches = np.round(draw.normal(0.0, 0.1, (count, 6)), 6).tolist()
    log = LogWriter(folder / "written.mcap", {})
    begun = time.perf_counter()
    for number, wrench in enumerate(wrenches):
        stamp = number * 1_000_000
        log.wrench(number, stamp, stamp, stamp, wrench)
        if number % 250 == 249:
            log.flush()
    each = (time.perf_counter() - begun) / count
    log.close({})
    size = (folder / "written.mcap").stat().st_size / count
    yield "writer", f"{1e6 * each:.1f} us per wrench, {0.1e6 * each:.2f} % of the period at 1 kHz, {size:.0f} bytes"


PARTS = {"writer": writer, "stream": stream, "kills": kills, "limit": limit, "packets": packets}


def main() -> None:
    """Run the named parts; by default all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=list(PARTS), choices=[*PARTS, []])
    parser.add_argument("--quick", action="store_true", help="a tenth of each part")
    options = parser.parse_args()
    for part in options.parts or PARTS:
        with tempfile.TemporaryDirectory() as folder:
            for name, text in PARTS[part](Path(folder), options.quick):
                print(f"{name}: {text}", flush=True)


if __name__ == "__main__":
    main()
