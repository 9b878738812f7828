# SPDX-License-Identifier: Apache-2.0
"""The folder of a study: its card and a Parquet file for each block, so that a stopped study continues."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError, install_step
from ..files import atomic_write, digest, json_safe, read_text
from ..recording.formats.parquet import pyarrow_for
from ..state_folder import StateFolder, key_of
from ..vocabulary import __version__
from .question import Question

CARD, BLOCKS = "study.json", "blocks"
RECORDED = ("split", "repeat", "rate", "depth", "force", "phase", "puncture_depths")
"""Columns of a recording."""


class BlockFolder:
    """A folder with the blocks of one question, which one program at a time can fill.

    Raises InputError for a folder of another study or version, or one in which another program works.
    """

    def __init__(self, path: Path, question: Question, inputs: dict):
        pyarrow_for("a study's result")
        asked = {"study": question.document(), "inputs": inputs}
        self.path, self._digest = path, key_of(json_safe(asked))
        card = {**asked, "digest": self._digest, "needleforce": __version__}
        if (path / CARD).exists():
            self._compare(card)
        elif path.exists() and any(path.iterdir()):
            raise InputError("folder of the study", str(path), "it holds other files", next_step="Give an empty one.")
        else:
            (path / BLOCKS).mkdir(parents=True, exist_ok=True)
            with atomic_write(path / CARD) as file:
                json.dump(json_safe(card), file, indent=2)
        self._state = StateFolder(path / "state", "study", {})

    def __enter__(self) -> "BlockFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self._state.close()

    def _compare(self, card: dict) -> None:
        """Raise InputError if the folder's card is that of another question or version."""
        step = "Give another folder, or remove this one."
        try:
            found = json.loads(read_text(self.path / CARD, "card of the study"))
            version = found["needleforce"]
        except (ValueError, TypeError, KeyError):
            raise InputError("folder of the study", str(self.path), f"{CARD} is damaged", next_step=step) from None
        for key, what in (("needleforce", f"version {version}"), ("digest", "another study, or of files that changed")):
            if found.get(key) != card[key]:
                limit = f"it holds the result of {what}"
                raise InputError("folder of the study", str(self.path), limit, next_step=step)

    def done(self, blocks: int) -> dict[int, dict[str, np.ndarray]]:
        """The blocks that are there in full, by number."""
        from pyarrow import parquet

        found = {}
        for number in range(blocks):
            kept = self._state.result(self._key(number))
            if kept is not None and self._file(number).is_file() and kept == digest(self._file(number)).encode():
                table = parquet.read_table(self._file(number))
                found[number] = {name: _array(table[name]) for name in table.column_names}
        return found

    def write(self, number: int, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Write a block in full or not at all, and return it."""
        _write_parquet(self._file(number), columns)
        content = digest(self._file(number)).encode()
        self._state.keep(self._key(number), content, task="block", number=number, rows=len(columns["number"]))
        return columns

    def _key(self, number: int) -> str:
        return key_of(self._digest, __version__, number)

    def write_recordings(self, number: int, columns: dict[str, np.ndarray], kind: str) -> dict[str, np.ndarray]:
        """Write the recordings of a block, a file for each part of the learning set; returns the columns of the
        insertions without them."""
        for split in np.unique(columns["split"]):
            chosen = columns["split"] == split
            folder = self.path / "recordings" / f"split={split}"
            folder.mkdir(parents=True, exist_ok=True)
            rows = {name: each[chosen] for name, each in columns.items() if name != "split"}
            _WRITERS[kind](folder / f"{number:06d}.{kind}", rows)
        once = columns["repeat"] == 0
        return {name: each[once] for name, each in columns.items() if name not in RECORDED}

    def finish(self, result: Any) -> None:
        """Write the summary of a study whose blocks are all there."""
        with atomic_write(self.path / "result.json") as file:
            file.write(result.to_json() + "\n")

    def _file(self, number: int) -> Path:
        return self.path / BLOCKS / f"{number:06d}.parquet"


def _write_parquet(path: Path, columns: dict[str, np.ndarray]) -> None:
    import pyarrow
    from pyarrow import parquet

    table = pyarrow.table({name: _column(pyarrow, each) for name, each in columns.items()})
    with atomic_write(path) as file:
        parquet.write_table(table, file.buffer, compression="zstd")


def _write_hdf5(path: Path, columns: dict[str, np.ndarray]) -> None:
    try:
        import h5py
    except ImportError:
        step = f"{install_step('h5py', 'labs')} Or use parquet."
        raise InputError("HDF5", "not available", "it needs h5py", str(path), step) from None
    with atomic_write(path) as file, h5py.File(file.buffer, "w") as made:
        for name, each in columns.items():
            made.create_dataset(name, data=each.astype("S") if each.dtype.kind in "UO" else each)


_WRITERS = {"parquet": _write_parquet, "hdf5": _write_hdf5}


def _column(pyarrow: Any, values: np.ndarray) -> Any:
    if values.ndim == 1:
        return pyarrow.array(values.tolist() if values.dtype == object else values)
    return pyarrow.FixedSizeListArray.from_arrays(pyarrow.array(values.ravel()), values.shape[1])


def _array(column: Any) -> np.ndarray:
    """A column of a table as ``simulated`` makes it."""
    import pyarrow

    if pyarrow.types.is_fixed_size_list(column.type):
        flat = column.combine_chunks().flatten().to_numpy(zero_copy_only=False)
        return flat.reshape(len(column), -1)
    values = column.to_numpy()
    return values.astype(str) if values.dtype == object else values
