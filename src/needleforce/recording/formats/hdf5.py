# SPDX-License-Identifier: Apache-2.0
"""HDF5, and MATLAB 7.3, by h5py: a group with vectors of one length is a table, and so is each matrix."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InputError
from ...files import check_count, open_regular, unpacked_limit
from ..stated import is_rate_name
from ..table import Table
from .arrays import Array, FileArrays, check_size, orientation, reading, size_of
from .matlab import matlab_header, object_step

_FORMAT = "HDF5"
_MAX_OBJECTS = 1 << 14  # groups and datasets of a file
_MAX_DEPTH = 32
_MAX_ATTRIBUTE_BYTES = 1 << 16
_MAX_ATTRIBUTES = 64  # of an object, that are kept as comments
_MAX_REFERENCES = 4096  # of a MATLAB cell array or array of structs
_UNITS = ("unit", "units", "Unit", "Units")
_NAMES = ("columns", "column_names", "names", "Columns")
_CLASS = "MATLAB_class"
_PLAIN_CLASSES = ("double single int8 uint8 int16 uint16 int32 uint32 int64 uint64 logical").split()


_CHUNK_OVERHEAD_BYTES = 64  # of a filter: checksums and heads
_COMPRESSING = {1, 4, 5, 6, 32000}  # deflate, szip, nbit, scale-offset, lzf
_FILTERS = _COMPRESSING | {2, 3}  # and shuffle, fletcher32


def tables(path: Path) -> list[Table]:
    """The tables of an HDF5 or MATLAB 7.3 file: the vectors of one length in a group, each matrix, the fields of a
    compound dataset.

    Links that leave the file, virtual datasets and filters of plugins are not followed. Raises InputError for a damaged
    file, for one that would take more memory than a recording, and for MATLAB objects such as ``table`` if nothing else
    is in the file.
    """
    with _opened(path) as file:
        matlab = any(_attribute(each, _CLASS) for each in _members(file, path))
        header = matlab_header if matlab else _header
        found = FileArrays(path=path, format=_FORMAT, header=header, separator="." if matlab else "/")
        _Walk(found=found, matlab=matlab, path=path).group(file, "" if matlab else "/", [], 0)
    return found.finish()


def _header(name: str, index: int) -> str:
    return f"{name}[:,{index}]"


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """The open file; the library sees a stream, so that it opens no other file and needs no lock."""
    import h5py

    with reading(path, _FORMAT), open_regular(path) as stream, h5py.File(stream, "r") as file:
        yield file


def _members(group: Any, path: Path) -> list[Any]:
    """The groups and datasets of a group, by name; links that are soft or leave the file are not followed."""
    import h5py

    check_count("groups and datasets", len(group), _MAX_OBJECTS, path)
    hard = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
    return [group[name] for name in hard if group.get(name, getclass=True) in (h5py.Group, h5py.Dataset)]


def _refusal(dataset: Any) -> str:
    """Why a dataset is not read, empty for one that is stored in the file itself, by filters of the library."""
    plan = dataset.id.get_create_plist()
    if dataset.is_virtual:
        return "a virtual dataset, whose values may be in other files"
    if plan.get_external_count():
        return "its values are in another file"
    filters = {number: name for number, _, _, name in map(plan.get_filter, range(plan.get_nfilters()))}
    for number, name in filters.items():
        if number not in _FILTERS:
            shown = name.decode("utf-8", "replace") if name else f"number {number}"
            return f"the filter {shown} needs a plugin; h5repack -f GZIP=4 OLD NEW writes it without"
    is_repeated = len(filters) < plan.get_nfilters() or len(_COMPRESSING & filters.keys()) > 1
    return "compressed more than once" if is_repeated else ""


def _check_chunks(dataset: Any, path: Path) -> None:
    """Raise InputError for a chunk that takes more bytes than its values: the library reads the beginning of it."""
    sizes = [0]
    if dataset.chunks is not None:
        dataset.id.chunk_iter(lambda chunk: sizes.append(chunk.size))
        stated = size_of(dataset.chunks, dataset.dtype.itemsize)
        if max(sizes) > stated + stated // 100 + _CHUNK_OVERHEAD_BYTES:
            raise InputError("size of a chunk", "larger than stated", "", str(path), "Check the file.")


class _Walk:
    """Collects the arrays of the groups of a file."""

    def __init__(self, *, found: FileArrays, matlab: bool, path: Path):
        self._found, self._matlab, self._path = found, matlab, path
        self._limit = unpacked_limit(path.stat().st_size)
        self._seen: set[tuple] = set()
        self._referring: set[int] = set()  # arrays of references that were followed
        self._size = 0

    def group(self, group: Any, level: str, outer: list, depth: int) -> None:
        """Add one group and those within it; ``outer`` are the single values and attributes around it."""
        members = {
            each.name.rsplit("/", 1)[-1]: each for each in _members(group, self._path) if not self._is_known(each)
        }
        hidden = [name for name in members if name.startswith("#")]  # MATLAB's own groups
        for name in hidden:
            del members[name]
        self._fields(level, members, [*self._attributes(group), *outer], depth)

    def _fields(self, level: str, fields: dict[str, Any], outer: list, depth: int) -> None:
        """Add the members of a group, or the objects to which the references of a struct or cell array point."""
        if depth > _MAX_DEPTH:
            raise ValueError(f"more than {_MAX_DEPTH} groups within each other")
        arrays, comments, inner = [], [], []
        for name, member in fields.items():
            if self._is_object(member, name):
                continue
            inner += [(name, member)] if _is_group(member) else self._dataset(member, name, arrays, comments)
        comments += [*_sampling(fields.values()), *self._facts(inner), *outer]
        self._found.add(level, arrays, comments)
        for name, member in inner:
            self._inner(f"{level}{name}" if name.startswith("{") else self._join(level, name), member, comments, depth)

    def _facts(self, inner: list[tuple[str, Any]]) -> list[tuple[str, str]]:
        """The attributes and single values of groups that hold nothing else, such as settings."""
        found = []
        for name, group in inner:
            members = _members(group, self._path) if _is_group(group) else [group]
            if all(not _is_group(each) and each.size == 1 and not each.dtype.names for each in members):
                single = [(each.name.rsplit("/", 1)[-1], self._single(each)) for each in members if not _refusal(each)]
                texts = [*(self._attributes(group) if _is_group(group) else []), *single]
                found += [(f"{name}/{key}", text) for key, text in texts if text]
        return found

    def _inner(self, label: str, member: Any, comments: list, depth: int) -> None:
        """Add a group, or the structs or cells to which a dataset of references points."""
        if not _is_group(member):
            cells = self._followed(member)
            self._fields(label, {f"{{{number}}}": each for number, each in enumerate(cells, 1)}, comments, depth + 1)
            return
        structs = self._struct_array(member)
        for number, fields in enumerate(structs, 1):
            self._fields(f"{label}({number})", fields, comments, depth + 1)
        if not structs:
            self.group(member, label, comments, depth + 1)

    def _dataset(self, dataset: Any, name: str, arrays: list[Array], comments: list) -> list[tuple[str, Any]]:
        """Add a dataset to the arrays or comments of its level; returns it if it consists of references."""
        import h5py

        kind, shape = dataset.dtype, dataset.shape
        if shape is None or dataset.size == 0 or _attribute(dataset, "MATLAB_empty"):
            return []
        if h5py.check_ref_dtype(kind) is h5py.Reference:
            return [(name, dataset)] if self._matlab else []
        reason = _refusal(dataset)
        if not reason and dataset.size == 1 and not kind.names:
            comments += [(name, text)] if (text := self._single(dataset)) else []
            return []
        if self._matlab and _attribute(dataset, _CLASS) == "char":
            comments += [(name, text)] if (text := self._text(dataset)) else []
            return []
        sides = orientation(shape)
        if reason or sides is None or (kind.names and sides[1] > 1) or (not kind.names and kind.kind not in "iufSO"):
            self._found.leave_out(f"{dataset.name} ({reason or f'{kind} of shape {shape}'})")
        elif kind.names:
            fields = [self._compound(dataset, field, sides[0]) for field in _fields(kind)]
            self._found.add(dataset.name, fields, self._attributes(dataset))
        else:
            arrays.append(self._array(dataset, name, sides))
        return []

    def _array(self, dataset: Any, name: str, sides: tuple[int, int, bool]) -> Array:
        rows, columns, transposed = sides
        units, names = _listed(dataset, _UNITS), _listed(dataset, _NAMES)
        units = units * columns if len(units) == 1 else units if len(units) == columns else []
        place = dataset.name
        return Array(
            name=name,
            rows=rows,
            columns=columns,
            read=lambda column: self._read(place, lambda each: _column(each, column, columns, transposed)),
            headers=names if len(names) == columns else [],
            units=units,
            numeric=dataset.dtype.kind in "iuf",
            vector=columns == 1,
        )

    def _compound(self, dataset: Any, field: str, rows: int) -> Array:
        units = _listed(dataset, _UNITS)
        position = dataset.dtype.names.index(field)
        place = dataset.name
        return Array(
            name=field,
            rows=rows,
            read=lambda _: self._read(place, lambda each: each[field].reshape(-1), field),
            numeric=dataset.dtype[field].kind in "iuf",
            units=[units[position]] if len(units) == len(dataset.dtype.names) else [],
        )

    def _read(self, place: str, part: Callable[[Any], np.ndarray], field: str = "") -> np.ndarray:
        """Values of a dataset, once its size is known to be bounded."""
        with _opened(self._path) as file:
            dataset = file[place]
            kind = dataset.dtype[field] if field else dataset.dtype
            if kind.kind not in "iuf":  # refused by its type: texts can be of any size
                return np.empty(0, kind)
            check_size(size_of(dataset.shape, dataset.dtype.itemsize), self._limit, self._path)
            _check_chunks(dataset, self._path)
            return part(dataset)

    def _struct_array(self, group: Any) -> list[dict[str, Any]]:
        """The structs of a MATLAB array of structs, whose fields are arrays of references; empty for another group."""
        import h5py

        members = {each.name.rsplit("/", 1)[-1]: each for each in _members(group, self._path)} if self._matlab else {}
        cells = [each for each in members.values() if not _is_group(each) and not _attribute(each, _CLASS)
                 and h5py.check_ref_dtype(each.dtype) is h5py.Reference]  # fmt: skip
        if not members or len(cells) != len(members) or len({each.shape for each in cells}) != 1:
            return []
        columns = {name: self._followed(each) for name, each in members.items()}
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]

    def _followed(self, dataset: Any) -> list[Any]:
        """The objects to which references point, in MATLAB's order; none for those that were followed before."""
        import h5py

        address = h5py.h5o.get_info(dataset.id).addr
        if address in self._referring:
            return []
        self._referring.add(address)
        check_count("cells", dataset.size, _MAX_REFERENCES, self._path)
        references = dataset[()].reshape(-1)  # rows and columns are exchanged in the file
        found = [dataset.file[each] for each in references if each]
        self._size += len(found)
        check_count("cells", self._size, _MAX_OBJECTS, self._path)
        return found

    def _is_known(self, member: Any) -> bool:
        """Whether an object was met before, by another name."""
        import h5py

        info = h5py.h5o.get_info(member.id)
        key = info.fileno, info.addr
        known = key in self._seen
        self._seen.add(key)
        check_count("groups and datasets", len(self._seen), _MAX_OBJECTS, self._path)
        return known and _is_group(member)

    def _is_object(self, member: Any, name: str) -> bool:
        """Whether something is a MATLAB object, which is left out with the way to export it."""
        kind = _attribute(member, _CLASS) if self._matlab else ""
        if kind in ("", *_PLAIN_CLASSES, "char", "cell", "struct"):
            return False
        self._found.step = object_step(kind)
        self._found.leave_out(f"{name} (of the MATLAB class {kind})")
        return True

    def _attributes(self, item: Any) -> list[tuple[str, str]]:
        """The attributes of a group as texts, those of MATLAB excepted."""
        names = [name for name in list(item.attrs)[:_MAX_ATTRIBUTES] if not name.startswith("MATLAB")]
        found = [(name, _attribute(item, name)) for name in names]
        return [(name, text) for name, text in found if text]

    def _single(self, dataset: Any) -> str:
        if dataset.dtype.kind not in "iufSO" or dataset.dtype.itemsize > _MAX_ATTRIBUTE_BYTES:
            return ""
        return _as_text(dataset[()])

    def _text(self, dataset: Any) -> str:
        """The text of a MATLAB array of characters."""
        if size_of(dataset.shape, dataset.dtype.itemsize) > _MAX_ATTRIBUTE_BYTES:
            return ""
        return "".join(map(chr, np.asarray(dataset[()], dtype=np.uint32).T.reshape(-1) & 0xFFFF))

    def _join(self, level: str, name: str) -> str:
        separator = "." if self._matlab else "/"
        return f"{level.rstrip(separator)}{separator}{name}" if level else name


def _sampling(members: Iterable[Any]) -> list[tuple[str, str]]:
    """The attributes of datasets that state the rate of samples, if all that do agree."""
    found: dict[str, set[str]] = {}
    for member in members:
        if not _is_group(member):
            for name in filter(is_rate_name, list(member.attrs)[:_MAX_ATTRIBUTES]):
                found.setdefault(name, set()).add(_attribute(member, name))
    return [(name, texts.pop()) for name, texts in found.items() if len(texts) == 1]


def _is_group(member: Any) -> bool:
    import h5py

    return isinstance(member, h5py.Group)


def _column(dataset: Any, column: int, columns: int, transposed: bool) -> np.ndarray:
    if columns == 1:
        return dataset[()].reshape(-1)
    shape = [axis for axis, size in enumerate(dataset.shape) if size != 1]
    picked: list[Any] = [0] * len(dataset.shape)
    picked[shape[0]], picked[shape[1]] = (column, slice(None)) if transposed else (slice(None), column)
    return dataset[tuple(picked)]


def _fields(kind: np.dtype) -> list[str]:
    return [name for name in kind.names if kind[name].subdtype is None and not kind[name].names]


def _listed(item: Any, names: tuple[str, ...]) -> list[str]:
    """The texts of the first of some attributes, or the parts of one text that is separated by commas."""
    for name in names:
        if name in item.attrs:
            values = _value(item, name)
            if isinstance(values, np.ndarray) and values.ndim == 1 and values.size <= 1024:
                return [_as_text(each) for each in values]
            text = _as_text(values)
            return [part.strip() for part in text.split(",")] if text else []
    return []


def _attribute(item: Any, name: str) -> str:
    """An attribute as text, empty if it is absent, too large or of another type."""
    return _as_text(_value(item, name)) if name in item.attrs else ""


def _value(item: Any, name: str) -> Any:
    attribute = item.attrs.get_id(name)
    if size_of(attribute.shape, attribute.dtype.itemsize) > _MAX_ATTRIBUTE_BYTES:
        return None
    return item.attrs[name]


def _as_text(value: Any) -> str:
    value = value.reshape(-1)[0] if isinstance(value, np.ndarray) and value.size == 1 else value
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    return str(value) if isinstance(value, str | np.number | int | float) else ""
