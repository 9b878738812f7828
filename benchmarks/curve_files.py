# SPDX-License-Identifier: Apache-2.0
"""Force curves by hand, as their makers describe the formats: JPK, Igor, and a small file of Nanosurf."""

import importlib.resources
import re
import struct
import zipfile
from io import BytesIO

import numpy as np

STIFFNESS, SENSITIVITY = 0.05, 60e-9  # [N/m], [m/V]
BENDING = np.clip(np.arange(400) - 250, 0, None) * 2  # counts of 1e-3 V
HEIGHT = 5000 - 10 * np.arange(400)  # counts of 1e-9 m, less towards the sample
RATE_HZ = 1000.0


def scaling(name, multiplier, unit, offset=0.0):
    lines = {"type": "linear", "style": "offsetmultiplier", "offset": offset, "multiplier": multiplier}
    return {f"{name}.{key}": value for key, value in (lines | {"unit.type": "metric-unit", "unit.unit": unit}).items()}


def channel(number, name, encoder, conversions):
    """The properties of a channel: its encoder and the conversions after it, each of the one before."""
    info = f"lcd-info.{number}"
    lines = {f"{info}.channel.name": name, f"{info}.encoder.type": "signedshort", f"{info}.unit.unit": encoder[1]}
    lines |= scaling(f"{info}.encoder.scaling", *encoder)
    before, sets = "base", f"{info}.conversion-set"
    lines |= {f"{sets}.conversions.base": "base", f"{sets}.conversion.base.defined": "false"}
    lines |= {f"{sets}.conversions.list": " ".join(slot for slot, *_ in conversions)}
    lines |= {f"{sets}.conversions.default": conversions[-1][0]}
    for slot, factor, unit in conversions:
        one = f"{sets}.conversion.{slot}"
        lines |= {f"{one}.defined": "true", f"{one}.name": slot, f"{one}.base-calibration-slot": before}
        lines |= scaling(f"{one}.scaling", factor, unit)
        before = slot
    return lines


def properties(lines):
    return "".join(f"{key}={value}\n" for key, value in lines.items())


def segment(style, count):
    head = "force-segment-header"
    lines = {f"{head}.duration": count / RATE_HZ, f"{head}.num-points": count, f"{head}.settings.style": style}
    lines |= {
        f"{head}.settings.segment-settings.style": style,
        f"{head}.time-stamp": "2024-01-01 12\\:00\\:00.000 +0100",
    }
    lines |= {f"{head}.settings.segment-settings.z-start": 4e-6, f"{head}.settings.segment-settings.z-end": 0.0}
    lines |= {f"{head}.approach-id": "a", f"{head}.settings.feedback-mode.name": "contact"}
    lines |= {f"{head}.settings.segment-settings.setpoint": 1.0}
    lines |= {f"{head}.settings.segment-settings.duration": count / RATE_HZ}
    lines |= {"channels.list": "height vDeflection"}
    for number, name in enumerate(("height", "vDeflection")):
        lines |= {f"channel.{name}.lcd-info.*": number, f"channel.{name}.data.file.name": f"channels/{name}.dat"}
        lines |= {f"channel.{name}.data.file.format": "raw", f"channel.{name}.data.num-points": count}
    return properties(lines)


def jpk(path=None, force=True):
    """A curve in two segments, in and out, written to a path; returns its bytes."""
    conversions = [("distance", SENSITIVITY, "m"), ("force", STIFFNESS, "N")][: 1 + force]
    shared = channel(0, "height", (1e-9, "m"), [("nominal", 1.0, "m"), ("calibrated", 1.0, "m")])
    shared |= channel(1, "vDeflection", (1e-3, "V"), conversions)
    head = {"jpk-data-file": "spm-forcefile", "type": "force-scan-series", "file-format-version": "2.0"}
    head |= {"force-scan-series.force-segments.count": 2, "force-scan-series.header.position.x": 0.0}
    head |= {"force-scan-series.header.position.y": 0.0, "force-scan-series.header.force-settings.closed-loop": "true"}
    head |= {"force-scan-series.description.instrument": "made by hand", "force-scan-series.header.position-index": 0}
    made = BytesIO()
    with zipfile.ZipFile(made, "w") as file:
        file.writestr("header.properties", properties(head))
        file.writestr("shared-data/header.properties", properties({"lcd-infos.count": 2} | shared))
        file.writestr("segments/", "")  # folders have entries
        for number, (style, step) in enumerate((("extend", 1), ("retract", -1))):
            file.writestr(f"segments/{number}/", "")
            file.writestr(f"segments/{number}/segment-header.properties", segment(style, 400))
            for name, values in (("height", HEIGHT), ("vDeflection", BENDING)):
                file.writestr(f"segments/{number}/channels/{name}.dat", values[::step].astype(">i2").tobytes())
    if path is not None:
        path.write_bytes(made.getvalue())
    return made.getvalue()


def igor_wave(values, step, unit, dimension_unit="s", labels=(), note=""):
    """A wave of version 5 as Igor's Technical Note 003 describes it; ``values`` is (n,) or (n, k)."""
    shape = [*values.shape, 0, 0, 0][:4]
    content = values.astype("<f4").tobytes("F")
    names = b"".join(name.encode().ljust(32, b"\0") for name in ("", *labels)) if labels else b""
    sizes = (0, len(note), 0, 0, 0, 0, 0, 0, len(names), 0, 0, 0, 0, 0)
    wave = struct.pack("<iIIihh6sh32sii", 0, 0, 0, values.size, 2, 0, b"", 1, b"made_by_hand", 0, 0)
    wave += struct.pack("<4i4d4d", *shape, step, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    wave += unit.encode().ljust(4, b"\0") + dimension_unit.encode().ljust(16, b"\0")
    wave = wave.ljust(320, b"\0")

    def head(checksum):
        return struct.pack("<hhi14i", 5, checksum, 320 + len(content), *sizes)[:64]

    words = np.frombuffer(head(0) + wave, "<i2").astype(int).sum()
    checksum = int(np.array(-words).astype(np.int16))
    return head(checksum) + wave + content + note.encode() + names


def nanosurf(lines: int = 3, points: int = 64) -> bytes:
    """The header of the example in Nanosurf's library without its images and results, with a few samples."""
    path = importlib.resources.files("NSFopen") / "example" / "Force_Spectroscopy" / "spectroscopy.nid"
    head = path.read_bytes().partition(b"#!")[0].decode("latin-1")
    sections = re.split(r"\r\n(?:\r\n)+", head.strip())
    kept = [s for s in sections if not re.match(r"\[(DataSet-([2-9]|\d\d)|SetView|Processor)", s)]
    text = "\r\n\r\n".join(kept)
    text = re.sub(r"GroupCount=\d+", "GroupCount=2", text)
    text = re.sub(r"Gr([2-9]|1\d)-\w+=.*\r\n", "", text)
    text = re.sub(r"LineDim([3-9]|\d\d)(Range|Min|Points)=.*\r\n", "", text)
    text = re.sub(r"(LineDim\dPoints|Points)=\d+", rf"\1={points}", re.sub(r"\nLines=\d+", f"\nLines={lines}", text))
    counts = np.linspace(-(2**30), 2**30, 4 * lines * points).astype("<i4")
    return text.encode("latin-1") + b"\r\n\r\n#!" + counts.tobytes()
