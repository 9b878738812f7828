# SPDX-License-Identifier: Apache-2.0
# ruff: noqa: E501 - the content of hostile files has long lines
"""Valid files of every format for ``hostile_files.py``, which ``hostile_changes.py`` changes."""

import datetime
import json
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from functools import cache
from io import BytesIO
from pathlib import Path

import curve_files
import numpy as np

ROOT = Path(__file__).parents[1]
ROWS = 60
TIME = 0.01 * np.arange(ROWS)
DEPTH = np.linspace(-5e-3, 20e-3, ROWS)
FORCE = 40.0 * DEPTH.clip(0.0)


def _joined(separator: str = "\t", *, time: bool = True) -> str:
    cells = (([f"{t:.3f}"] if time else []) + [f"{1e3 * d:.4f}", f"{f:.5f}"] for t, d, f in zip(TIME, DEPTH, FORCE))
    return "\n".join(map(separator.join, cells)) + "\n"


def zipped_again(data: bytes, changed: Callable[[str, bytes], tuple[str, bytes]], *more: tuple[str, bytes]) -> bytes:
    """An archive with another name and content for each of its members, and more of them."""
    made = BytesIO()
    with (
        zipfile.ZipFile(BytesIO(data)) as old,
        zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as new,
        warnings.catch_warnings(),
    ):
        warnings.simplefilter("ignore")  # a name that is there twice is meant
        for name in old.namelist():
            new.writestr(*changed(name, old.read(name)))
        for name, part in more:
            new.writestr(name, part)
    return made.getvalue()


def texts(form: int) -> bytes:
    """Text as instruments write it."""
    rows = _joined()
    block = "<INFO>\nDate:\t1.2.2026\n<DATA>\nTime, s\tPosition (z), mm\tFz, gf\n" + rows
    cycle = "\n".join(f"{k // 20 + 1},{row}" for k, row in enumerate(_joined(",").splitlines())) + "\n"
    forms = [
        block + "<END DATA>\n" + block,
        'Test : 1,"10.0",mm/min\n\nTime,Extension,Load\n(s),(mm),(N)\n"'
        + rows.replace("\t", '","').replace("\n", '"\n"')[:-1],
        rows,
        ("Zeit;Weg;Kraft\ns;mm;N\n" + rows.replace("\t", ";").replace(".", ",")),
        "Time\tPd\tFn\n" + "\n".join(f"12:00:{row}" for row in rows.splitlines()),
        "\n".join("\t".join([line] * 3) for line in ("Time (s)\tz (mm)\tF (N)\n" + rows).splitlines()),
        "Indentation\n\n   Max load :\t1000.00 \tµN\n\nTime (s)\tPd (µm)\tFn (µN)\n\n" + rows,
        "Date\t29/09/2021\tStatus\tOK\r\n\r\nk (N/m)\t4.640\r\nTime (s)\tLoad (uN)\tIndentation (nm)\r\n" + rows,
        '"Standardkraft";"Standardweg";"Prüfzeit"\n"N";"mm";"s"\n' + rows.replace("\t", ";").replace(".", ","),
        "Force\tDistance\tTime\n(g)\t(mm)\t(sec)\n" + rows + "\t\t\n" * 3,
        "\n".join(f"A1,{row}" for row in _joined(",", time=False).splitlines()) + "\n",
        "Cycle,Time (s),Position (mm),Force (N)\n" + cycle,
        "2026-01-02T03:04:05.678,0,0\n"
        + "".join(f"2026-01-02T03:{5 + k // 60:02d}:{k % 60:02d}.{k:03d},{k / 100},{k / 9:.3f}\n" for k in range(ROWS)),
        "# time depth force\n# s mm N\n" + _joined("  "),
    ]
    return forms[form].encode({3: "utf-16", 6: "latin-1", 8: "cp1252"}.get(form, "utf-8"))


def lvm(form: int) -> bytes:
    """A LabVIEW measurement file; ``form`` has the decimal sign, the columns of X and the segments."""
    x = ("One", "No", "Multi")[form % 3]
    head = ["LabVIEW Measurement", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", f"Decimal_Separator\t{'.,'[form % 2]}",
            "Multi_Headings\tYes", f"X_Columns\t{x}", "Time_Pref\tRelative", "Date\t2026/01/02", "***End_of_Header***", ""]  # fmt: skip
    part = ["Channels\t2", f"Samples\t{ROWS}\t{ROWS}", "Y_Unit_Label\tN\tmm", "X_Dimension\tTime\tTime", "X0\t0.0E+0\t0.0E+0",
            "Delta_X\t0.01\t0.01", "***End_of_Header***", "X_Value\tForce\tDepth\tComment"]  # fmt: skip
    part[-1] = "X_Value\tForce\tX_Value\tDepth" if x == "Multi" else part[-1]
    for t, d, f in zip(TIME, 1e3 * DEPTH, FORCE):
        cells = {"One": (t, f, d), "No": ("", f, d), "Multi": (t, f, t, d)}[x]
        part.append("\t".join(str(cell) for cell in cells).replace(".", ".,"[form % 2]))
    return "\r\n".join(head + ([*part, ""]) * (1 + form // 3 * 2)).encode()


def excel(form: int) -> bytes:
    import openpyxl

    book = openpyxl.Workbook()
    rows = [("Time [s]", "Depth [mm]", "Force [N]"), *zip(TIME.tolist(), (1e3 * DEPTH).tolist(), FORCE.tolist())]
    for sheet in [book.active, *(book.create_sheet(f"s{k}") for k in range(form % 3))]:
        if form == 3:
            sheet.append(("Specimen", "x", datetime.datetime(2026, 1, 2)))
        for k, row in enumerate(rows):
            sheet.append((row[0], row[1], f"=B{k}*2") if form == 4 and k else row)
    if form == 5:
        book.active.merge_cells("A1:C1")
        book.create_chartsheet("c")
    made = BytesIO()
    book.save(made)
    return made.getvalue()


def xlsm(form: int) -> bytes:
    """A workbook with a project of macros, whose bytes are none that a program could run."""
    plain = b"application/vnd.openxmlformats-officedocument.spreadsheetml.sheet.main+xml"
    macros = b"application/vnd.ms-excel.sheet.macroEnabled.main+xml"
    project = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(504) + b"Attribute VB_Name" * 20
    return zipped_again(
        excel(form),
        lambda name, part: (name, part.replace(plain, macros) if name == "[Content_Types].xml" else part),
        ("xl/vbaProject.bin", project),
    )


def xls(form: int) -> bytes:
    import xlwt

    book = xlwt.Workbook()
    for number in range(1 + form % 3):
        sheet = book.add_sheet(f"s{number}")
        sheet.write_merge(0, 0, 0, 2, "Specimen") if form > 3 else None
        for column, (name, values) in enumerate(
            (("Time [s]", TIME), ("Depth [mm]", 1e3 * DEPTH), ("Force [N]", FORCE))
        ):
            sheet.write(1, column, name)
            for row, value in enumerate(values.tolist(), 2):
                formula = form == 3 and column == 2
                sheet.write(row, column, xlwt.Formula(f"B{row}*2") if formula else value)
    made = BytesIO()
    book.save(made)
    return made.getvalue()


def npy(form: int) -> bytes:
    made = BytesIO()
    matrix = np.stack([TIME, DEPTH, FORCE], axis=1)
    fields = [("t", "<f8"), ("F", ">f4"), ("more", [("x", "<i2"), ("y", "<f8", (3,))])]
    arrays = [matrix, np.asfortranarray(matrix), matrix.T.astype(">f4"), np.zeros(ROWS, dtype=fields),
              np.array([{"a": 1}] * ROWS, dtype=object), (1e6 * TIME).astype("m8[us]")]  # fmt: skip
    np.save(made, arrays[form])
    return made.getvalue()


def npz(form: int) -> bytes:
    made = BytesIO()
    save = np.savez_compressed if form % 2 else np.savez
    more = {"objects": np.array([None] * ROWS)} if form > 3 else {"matrix": np.zeros((ROWS, 3)), "single": 3.0}
    save(made, time=TIME, depth=DEPTH, force=FORCE.astype(np.float32), **more)
    return made.getvalue()


def matlab(form: int) -> bytes:
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


def hdf5(form: int) -> bytes:
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


def matlab73(form: int) -> bytes:
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


def tdms(form: int) -> bytes:
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


def records(form: int) -> bytes:
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


def jpk(form: int) -> bytes:
    """A force curve, of a force or without its scale."""
    return curve_files.jpk(force=form > 0)


def nanosurf(form: int) -> bytes:
    """Force curves of one, two or three groups."""
    return curve_files.nanosurf(1 + form % 3)


def igor(form: int) -> bytes:
    columns = np.stack([1e-6 * DEPTH, 1e-9 * FORCE, 1e-6 * DEPTH], axis=1)
    labels, note = ("Raw", "Defl", "ZSnsr"), "SpringConstant:0.05\rNumPtsPerSec:100\r"
    waves = [
        (FORCE, 0.01, "N"),
        (columns, 0.01, "m", "s", labels, note),
        (columns.T, 0.01, "m", "s"),
        (columns, 0.0, "", ""),
    ]
    return curve_files.igor_wave(*waves[form % len(waves)])


def csv_text() -> str:
    """A valid recording in text."""
    depth = np.linspace(-5.0, 20.0, ROWS)
    rows = (f"{0.01 * k:.3f},{at:.4f},{0.04 * max(at, 0.0):.5f}" for k, at in enumerate(depth))
    return "\n".join(["time_s,depth_mm,force_N", *rows]) + "\n"


@cache
def parquet(codec: str = "zstd", version: str = "1.0", dictionary: bool = False) -> bytes:
    columns = {"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE}
    options = {"use_dictionary": dictionary, "data_page_version": version, "row_group_size": 25}
    return parquet_of(columns, compression=codec, **options)


def parquet_of(columns: dict[str, np.ndarray], **options) -> bytes:
    import pyarrow
    import pyarrow.parquet

    made = BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(columns), made, **options)
    return made.getvalue()


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
    import tomllib

    preset = tomllib.loads(definitions()[0])
    recordings = [{"file": "a.csv", "status": "ok", "sha256": "0" * 64}]
    return json.dumps(
        {"recordings": recordings, "parameters": [], "model": "paper", "preset": preset, "settings": {}, "warnings": []}
    )
