# SPDX-License-Identifier: Apache-2.0
"""One insertion in every format of arrays gives one recording, and several in one file are its parts."""

import json

import numpy as np
import pytest
from plain_insertion import insertion

import needleforce as nf

TIME, DEPTH, FORCE = insertion(rate=100.0)


def npz(path, runs):
    arrays = {f"{name}_{quantity}": values for name, run in runs.items() for quantity, values in run.items()}
    np.savez(path, **(arrays if len(runs) > 1 else next(iter(runs.values()))))


def npy(path, runs):
    run = next(iter(runs.values()))
    table = np.zeros(len(TIME), dtype=[(name, "f8") for name in run])
    for name in run:
        table[name] = run[name]
    np.save(path, table)


def matlab(path, runs):
    from scipy.io import savemat

    savemat(path, runs if len(runs) > 1 else next(iter(runs.values())))


def hdf5(path, runs):
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        for name, run in runs.items():
            for quantity, values in run.items():
                file.create_dataset(f"{name}/{quantity}", data=values, compression="gzip")


def tdms(path, runs):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(path) as writer:
        channels = [nptdms.ChannelObject(name, *pair) for name, run in runs.items() for pair in run.items()]
        writer.write_segment(channels)


def records(path, runs):
    run = next(iter(runs.values()))
    rows = (dict(zip(run, row)) for row in zip(*(values.tolist() for values in run.values())))
    path.write_text("\n".join(map(json.dumps, rows)))


def lists(path, runs):
    path.write_text(json.dumps({name: {q: v.tolist() for q, v in run.items()} for name, run in runs.items()}))


RUN = {"time_s": TIME, "depth_m": DEPTH, "force_N": FORCE}


@pytest.mark.parametrize("write", [npz, npy, matlab, hdf5, tdms, records, lists])
def test_every_format_gives_the_same_recording(tmp_path, write):
    path = tmp_path / {npz: "x.npz", npy: "x.npy", matlab: "x.mat"}.get(write, "x.any")
    write(path, {"run": RUN})
    recording = nf.read(path, baseline=False)
    for quantity, values in (("time", TIME), ("depth", DEPTH), ("force", FORCE)):
        assert getattr(recording, quantity).tobytes() == values.tobytes()
    assert recording.card.sha256


@pytest.mark.parametrize("write", [matlab, hdf5, tdms, lists])
def test_several_recordings_in_one_file_are_chosen_by_name(tmp_path, write):
    path = tmp_path / ("x.mat" if write is matlab else "x.any")
    write(path, {"first": RUN, "second": {**RUN, "force_N": 2.0 * FORCE}})
    with pytest.raises(nf.InputError, match=r"number of recordings is 2, the file has '/?first', '/?second'"):
        nf.read(path)
    recording = nf.read(path, part="/second" if write is hdf5 else "second", baseline=False)
    assert recording.force.tolist() == (2.0 * FORCE).tolist()


def test_what_was_left_out_is_a_note_of_the_recording(tmp_path):
    np.savez(tmp_path / "x.npz", **RUN, image=np.zeros((200, 200)))
    (note,) = [note for note in nf.read(tmp_path / "x.npz").notes if "image" in note.message]
    assert note.kind == "left_out"
    records(tmp_path / "x.jsonl", {"run": RUN})
    text = (tmp_path / "x.jsonl").read_text()
    (tmp_path / "x.jsonl").write_text(text[:-9])
    recording = nf.read(tmp_path / "x.jsonl")
    assert len(recording) == len(TIME) - 1 and "cut_off" in {note.kind for note in recording.notes}
