# SPDX-License-Identifier: Apache-2.0
"""How ``hostile_files.py`` reads the files of each format, and what it expects of values and errors."""

from collections.abc import Callable
from pathlib import Path

import hostile_arrays
import hostile_content as content
import numpy as np

import needleforce as nf
from needleforce.files import MAX_DEFINITION_BYTES, MAX_RECORDING_BYTES, MAX_RESULT_BYTES


def _read(path: Path) -> list[nf.Recording]:
    return [nf.read(path)]


_BY_POSITION = ({"depth": 2, "force": 3}, {"time": 1, "depth": 2, "force": 3})


def _read_all(path: Path) -> list[nf.Recording]:
    """Every recording of a file, by position where it has no headers."""
    for columns in (None, *_BY_POSITION):
        try:
            return nf.read_all(path, test="indentation", columns=columns, units={"depth": "mm"} if columns else None)
        except nf.InputError as error:
            check_advice(error)
            refusal = error
    raise refusal


def _read_tables(path: Path) -> list[nf.Recording]:
    """Every column of a file, and its recordings if it has any."""
    hostile_arrays.read_tables(path)
    try:
        return nf.read_all(path, test="indentation")
    except nf.InputError as error:
        check_advice(error)
    return []


def _mapping(path: Path) -> list[nf.Recording]:
    """A recording, read with a mapping file."""
    run = path.parent / "run.csv"
    run.write_bytes(content.csv_text().encode())
    return nf.read_all(run, mapping=path)


def check_advice(error: nf.InputError) -> None:
    assert error.next_step, f"an error without next step: {error}"


def check_values(found: object) -> None:
    """Of the recordings that were read, every sample is a finite number, and there are some."""
    for each in found if isinstance(found, list) else []:
        values = np.array([each.time, each.depth, each.velocity, each.force])
        assert values.shape[1] > 1, f"a recording of {values.shape[1]} samples"
        assert np.isfinite(values).all(), f"{np.count_nonzero(~np.isfinite(values))} values are no finite numbers"


def _page(path: Path) -> None:
    from needleforce.acquisition.sources.net_ft_sensor import read_configuration

    read_configuration("", str(path))


def _calibration(path: Path) -> None:
    from needleforce.acquisition.sources.gauge_calibration import read_calibration

    read_calibration(path)


def _definition(path: Path) -> None:
    """A file of parameters as each of what it may be: most of them refuse it."""
    from needleforce.preset_files.build import read_needle, read_tissue
    from needleforce.protocol.reading import read_protocol

    refusals = []
    for read in (nf.preset, read_needle, read_tissue, read_protocol):
        try:
            read(path)
        except nf.InputError as error:
            refusals.append(error)
    if len(refusals) == 4:
        raise refusals[0]


def _table(path: Path) -> None:
    from needleforce.bench_tests import tissue_estimate
    from needleforce.campaign.labels import read_mapping

    refusals = []
    for read in (read_mapping, tissue_estimate):
        try:
            read(path)
        except nf.InputError as error:
            refusals.append(error)
    if len(refusals) == 2:
        raise refusals[0]


# format -> its reader, the largest file in bytes, what is read
FORMATS: dict[str, tuple[Callable, int, str]] = {
    "csv": (_read, MAX_RECORDING_BYTES, "recording, CSV"),
    "parquet": (_read, MAX_RECORDING_BYTES, "recording, Parquet"),
    "mcap": (_read, MAX_RECORDING_BYTES, "recording, MCAP"),
    "bag": (_read, MAX_RECORDING_BYTES, "recording, folder of a ROS 2 bag"),
    "ros1": (_read, MAX_RECORDING_BYTES, "recording, ROS 1 bag"),
    "forms": (_read_all, MAX_RECORDING_BYTES, "recording, text of instruments"),
    "excel": (_read_all, MAX_RECORDING_BYTES, "recording, Excel (xlsx)"),
    "xlsm": (_read_all, MAX_RECORDING_BYTES, "recording, Excel with macros (xlsm)"),
    "xls": (_read_all, MAX_RECORDING_BYTES, "recording, Excel (xls)"),
    "lvm": (_read_all, 1 << 28, "recording, LabVIEW text (lvm)"),
    "npy": (_read_tables, MAX_RECORDING_BYTES, "recording, NumPy npy"),
    "npz": (_read_tables, MAX_RECORDING_BYTES, "recording, NumPy npz"),
    "matlab": (_read_tables, MAX_RECORDING_BYTES, "recording, MATLAB 4 and 5"),
    "matlab73": (_read_tables, MAX_RECORDING_BYTES, "recording, MATLAB 7.3"),
    "hdf5": (_read_tables, MAX_RECORDING_BYTES, "recording, HDF5"),
    "tdms": (_read_tables, MAX_RECORDING_BYTES, "recording, TDMS"),
    "records": (_read_tables, MAX_RECORDING_BYTES, "recording, JSON and JSON lines"),
    "jpk": (_read_tables, MAX_RECORDING_BYTES, "force curve, JPK"),
    "igor": (_read_tables, MAX_RECORDING_BYTES, "wave of Igor (ibw)"),
    "nanosurf": (_read_tables, MAX_RECORDING_BYTES, "force curves, Nanosurf (nid)"),
    "toml": (_definition, MAX_DEFINITION_BYTES, "preset, needle, tissue, protocol, TOML"),
    "json": (nf.preset, MAX_RESULT_BYTES, "fit, JSON"),
    "mapping": (_mapping, MAX_DEFINITION_BYTES, "mapping of an instrument, TOML"),
    "page": (_page, 1 << 18, "sensor page, XML"),
    "calibration": (_calibration, MAX_DEFINITION_BYTES, "gauge calibration, TOML, CSV, XML"),
    "table": (_table, 1 << 23, "mapping and bench tests, CSV"),
}
