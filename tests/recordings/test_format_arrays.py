# SPDX-License-Identifier: Apache-2.0
"""NumPy and JSON files as tables: written by their own libraries, and by hand as laboratories differ."""

import json
import pickle
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

from needleforce.errors import InputError
from needleforce.recording.formats.detect import format_of, tables_of

TIME = np.arange(50) * 0.02
FORCE = np.sin(TIME)


def columns(path, table=0):
    """The columns of a table by header."""
    found = tables_of(path)[table]
    return {header: found.read_column(index) for index, header in enumerate(found.headers)}


def npy(array, **options):
    made = BytesIO()
    np.save(made, array, **options)
    return made.getvalue()


@pytest.mark.parametrize("save", [np.savez, np.savez_compressed])
def test_vectors_of_one_length_are_a_table_with_what_is_as_long(tmp_path, save):
    path = tmp_path / "run.any"
    with open(path, "wb") as file:
        wrench = np.arange(300, dtype="<f4").reshape(50, 6)
        save(file, time=TIME, fz=FORCE.astype(np.float32), counts=np.arange(50, dtype=">i2"), wrench=wrench, rate=50.0)
    assert format_of(path).name == "NumPy (npz)"
    found = columns(path)
    assert list(found) == ["time", "fz", "counts", *(f"wrench[:,{k}]" for k in range(6))]
    assert (found["time"] == TIME).all() and (found["fz"] == FORCE.astype(np.float32)).all()
    assert (found["counts"] == np.arange(50)).all() and (found["wrench[:,4]"] == np.arange(4, 300, 6)).all()
    assert (0, "rate: 50.0") in tables_of(path)[0].comments


def test_other_lengths_and_matrices_are_tables_of_their_own(tmp_path):
    np.savez(
        tmp_path / "x.npz", time=TIME, force=FORCE, slow=TIME[::5], again=FORCE[::5], a=np.ones((7, 2)), b=np.eye(9)
    )
    found = tables_of(tmp_path / "x.npz")
    assert [table.name for table in found] == ["(50 rows)", "(10 rows)", "a", "b"]
    assert [table.headers for table in found[:3]] == [["time", "force"], ["slow", "again"], ["a[:,0]", "a[:,1]"]]
    assert (columns(tmp_path / "x.npz", 1)["again"] == FORCE[::5]).all()


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", ["<f8", ">f4", "<i2", "u1"])
@pytest.mark.parametrize("rows", [True, False])
def test_a_matrix_in_any_order_and_type(tmp_path, order, kind, rows):
    matrix = np.arange(120).reshape(40, 3)
    stored = np.array(matrix if rows else matrix.T, dtype=kind, order=order)
    np.save(tmp_path / "x.npy", stored)
    found = columns(tmp_path / "x.npy")
    assert list(found) == ["column 1", "column 2", "column 3"]
    for index, values in enumerate(found.values()):
        assert (values == matrix[:, index]).all()


def test_a_large_matrix_is_read_in_blocks(tmp_path):
    matrix = np.arange(1_200_000.0).reshape(300_000, 4)
    for stored in (matrix, np.asfortranarray(matrix), matrix.T):
        np.save(tmp_path / "x.npy", stored)
        found = columns(tmp_path / "x.npy")
        assert all((values == matrix[:, k]).all() for k, values in enumerate(found.values()))


@pytest.mark.filterwarnings("ignore:Stored array in format 3")
def test_structured_arrays_have_their_fields_as_columns(tmp_path):
    kind = [("t", "<f8"), ("力 [N]", ">f4"), ("more", [("xyz", "<i2", (3,)), ("text", "U4")])]
    array = np.zeros(20, dtype=kind)
    array["t"], array["力 [N]"] = TIME[:20], FORCE[:20]
    array["more"]["xyz"] = np.arange(60).reshape(20, 3)
    np.save(tmp_path / "x.npy", array)
    found = tables_of(tmp_path / "x.npy")[0]
    assert found.headers == ["t", "力 [N]", "more.xyz[0]", "more.xyz[1]", "more.xyz[2]", "more.text"]
    assert (found.read_column(1) == FORCE[:20].astype("f4")).all()
    assert (found.read_column(3) == np.arange(1, 60, 3)).all()
    with pytest.raises(InputError, match=r"column 'more\.text' is of type <U4, a column of numbers is needed"):
        found.read_column(5)


def test_time_stamps_are_seconds(tmp_path):
    stamps = np.datetime64("2024-05-06T07:08:09", "ms") + (1000 * TIME).astype("m8[ms]")
    np.savez(tmp_path / "x.npz", stamp=stamps, force=FORCE)
    found = columns(tmp_path / "x.npz")
    np.testing.assert_allclose(found["stamp [s]"] - 1714979289.0, TIME, atol=1e-6)


class Trap:
    """A pickle that makes a file when it is loaded."""

    def __init__(self, path):
        self.path = str(path)

    def __reduce__(self):
        return Path.touch, (Path(self.path),)


def test_pickled_objects_are_never_loaded(tmp_path):
    trap = np.array([Trap(tmp_path / "made")] * 50, dtype=object)
    np.save(tmp_path / "x.npy", trap)
    np.savez(tmp_path / "x.npz", time=TIME, force=trap, info=np.array(Trap(tmp_path / "made"), dtype=object))
    with pytest.raises(InputError, match=r"without a table.*np\.savez\(path, time=time"):
        tables_of(tmp_path / "x.npy")
    table = tables_of(tmp_path / "x.npz")[0]
    assert (table.read_column(0) == TIME).all() and "info (pickled Python objects)" in table.notes[0].message
    with pytest.raises(
        InputError, match=r"column 'force' is of pickled Python objects, they are never loaded.*np\.savez"
    ):
        table.read_column(1)
    assert not (tmp_path / "made").exists()
    np.load(tmp_path / "x.npz", allow_pickle=True)["force"]  # the trap works
    assert (tmp_path / "made").exists()


def test_a_pickle_alone_is_no_array(tmp_path):
    (tmp_path / "x.npy").write_bytes(pickle.dumps(Trap(tmp_path / "made")))
    with pytest.raises(InputError):
        tables_of(tmp_path / "x.npy")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    "shape", ["(10**12,)", "(1000000000000,)", "(3000000000, 2)", "(-5, 2)", "(" * 3000, "()", "(0, 3)", "'x'"]
)
def test_a_shape_that_the_file_does_not_have_is_refused(tmp_path, shape):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    (tmp_path / "x.npy").write_bytes(b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head + bytes(80))
    with pytest.raises(InputError):
        tables_of(tmp_path / "x.npy")


def test_a_truncated_array_is_refused_at_any_place(tmp_path):
    whole = npy(np.stack([TIME, FORCE], axis=1))
    for size in range(6, len(whole), 37):
        (tmp_path / "x.npy").write_bytes(whole[:size])
        with pytest.raises(InputError):
            tables_of(tmp_path / "x.npy")


def zipped(path, members, **options):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, **options) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return path


def test_members_are_never_used_as_paths(tmp_path):
    path = zipped(
        tmp_path / "x.npz", {"../../time.npy": npy(TIME), "/etc/fz.npy": npy(FORCE), "\x1b[2Ja.npy": npy(TIME)}
    )
    found = columns(path)
    assert list(found) == ["../../time", "/etc/fz", "\\x1b[2Ja"] and (found["/etc/fz"] == FORCE).all()
    assert [each.name for each in tmp_path.iterdir()] == ["x.npz"]


def test_an_archive_that_unpacks_to_gigabytes_is_refused(tmp_path):
    zeros = npy(np.zeros(20_000_000))
    path = zipped(tmp_path / "x.npz", {"time.npy": zeros, "force.npy": zeros})
    assert path.stat().st_size < 1 << 20
    with pytest.raises(InputError, match="unpacked size is 305 MiB, at most"):
        tables_of(path)


def test_an_archive_that_states_less_than_it_holds_is_refused(tmp_path):
    path = zipped(tmp_path / "x.npz", {"time.npy": npy(np.zeros(1000))})
    data = bytearray(path.read_bytes())
    at = data.rfind(b"PK\1\2") + 24
    assert int.from_bytes(data[at : at + 4], "little") == len(npy(np.zeros(1000)))
    data[at : at + 4] = (200).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(InputError, match="not readable as NumPy, BadZipFile: Bad CRC"):
        tables_of(path)


def test_other_compression_and_encryption_are_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "x.npz", "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("time.npy", npy(TIME))
    with pytest.raises(InputError, match=r"deflate without encryption is read.*np\.savez"):
        tables_of(tmp_path / "x.npz")


def test_json_lines(tmp_path):
    rows = [
        {"t": t, "wrench": {"fz": f, "at": {"x": 1}}, "q": [k, -k], "note": "a"}
        for k, (t, f) in enumerate(zip(TIME, FORCE))
    ]
    rows[3].pop("wrench")
    rows[4]["t"] = None
    (tmp_path / "x.txt").write_text("\n".join(map(json.dumps, rows)) + "\n")
    found = tables_of(tmp_path / "x.txt")[0]
    assert found.headers == ["t", "wrench.fz", "wrench.at.x", "q[0]", "q[1]", "note"]
    fz, t = found.read_column(1), found.read_column(0)
    assert np.isnan(fz[3]) and (np.delete(fz, 3) == np.delete(FORCE, 3)).all()
    assert np.isnan(t[4]) and (np.delete(t, 4) == np.delete(TIME, 4)).all()
    assert (found.read_column(4) == -np.arange(50)).all()
    with pytest.raises(InputError, match=r"line 1: column 'note' is 'a', a number is needed"):
        found.read_column(5)


def test_a_text_among_numbers_is_refused_with_its_line(tmp_path):
    (tmp_path / "x").write_text('{"t": 0, "F": 1}\n\n{"t": 1, "F": "OVER"}\n{"t": NaN, "F": 3}\n')
    found = tables_of(tmp_path / "x")[0]
    assert found.read_column(0)[:2].tolist() == [0.0, 1.0] and np.isnan(found.read_column(0)[2])
    with pytest.raises(InputError, match="line 3: column 'F' is 'OVER'"):
        found.read_column(1)


def test_a_truncated_last_line_is_left_out_with_a_note_and_no_other(tmp_path):
    text = "".join(f'{{"t": {k}, "F": {2 * k}}}\n' for k in range(5))
    for cut in range(1, 12):
        (tmp_path / "x").write_text(text[:-cut])
        found = tables_of(tmp_path / "x")[0]
        whole = cut == 1  # only the line feed
        assert len(found.read_column(1)) == (5 if whole else 4)
        assert [note.kind for note in found.notes] == ([] if whole else ["cut_off"])
    (tmp_path / "x").write_text(text.replace('"F": 4}', '"F": 4'))
    with pytest.raises(InputError, match="line 3: line is not readable"):
        tables_of(tmp_path / "x")


@pytest.mark.parametrize("indent", [None, 1])
def test_a_list_of_objects_and_objects_of_lists(tmp_path, indent):
    rows = [{"t": t, "F": f} for t, f in zip(TIME, FORCE)]
    (tmp_path / "a.json").write_text(json.dumps(rows, indent=indent))
    assert (columns(tmp_path / "a.json")["F"] == FORCE).all()
    lists = {"rate": 50, "units": {"time": "ms"}, "time": TIME.tolist(), "F": FORCE.tolist(),
             "probe": {"a": [1, 2, 3], "M": [[1, 2], [3, 4]]}, "trials": rows[:4]}  # fmt: skip
    (tmp_path / "b.json").write_text("\ufeff" + json.dumps(lists, indent=indent), encoding="utf-8")
    found = tables_of(tmp_path / "b.json")
    assert [table.name for table in found] == ["(50 rows)", "probe", "probe.M", "trials"]
    assert found[0].headers == ["time", "F"] and found[0].units == ["ms", ""] and (0, "rate: 50") in found[0].comments
    assert found[2].read_column(1).tolist() == [2.0, 4.0] and found[3].read_column(1).tolist() == FORCE[:4].tolist()


def test_an_integer_beyond_any_float_is_infinite(tmp_path):
    for text in ('{"t": 1}\n{"t": -%s}\n{"t": 2}\n', '{"t": [1, -%s, 2]}'):
        (tmp_path / "x").write_text(text % ("9" * 400))
        assert tables_of(tmp_path / "x")[0].read_column(0).tolist() == [1.0, -np.inf, 2.0]


@pytest.mark.parametrize("orient", ["columns", "split", "records", "list"])
def test_what_pandas_writes(tmp_path, orient):
    import pandas

    frame = pandas.DataFrame({"time": np.round(TIME, 10), "force": np.round(FORCE, 10)})
    if orient == "list":
        (tmp_path / "x.json").write_text(json.dumps(frame.to_dict("list")))
    else:
        frame.to_json(tmp_path / "x.json", orient=orient)
    found = columns(tmp_path / "x.json")
    np.testing.assert_allclose(found["force"], FORCE, atol=1e-9)
    np.testing.assert_allclose(found["time"], TIME, atol=1e-9)


@pytest.mark.parametrize(
    "text",
    ["{}", "{", '{"a": 1}', "[{}]", '[{"a": "b"}]', '{"a": [1, 2', '{"a":' * 50_000, "[{" * 9, '{"a": ["x", "y"]}'],
)
def test_json_without_a_table_is_refused(tmp_path, text):
    (tmp_path / "x.json").write_text(text)
    with pytest.raises(InputError, match=r"x\.json"):
        tables_of(tmp_path / "x.json")
