# SPDX-License-Identifier: Apache-2.0
"""Files: bounded reading of regular files only, atomic writing, TOML and XML that cannot exhaust memory or time, and
text cells that no spreadsheet evaluates."""

import hashlib
import math
import os
import re
import secrets
import stat
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, TextIO
from xml.etree import ElementTree

from .errors import InputError, did_you_mean

MAX_RECORDING_BYTES = 1 << 31
"""Bytes of a recording: five hours at 1 kHz in text with twelve columns."""
MAX_SAMPLES = 1 << 25
"""Samples of a recording: nine hours at 1 kHz, 80 minutes of the fastest sensor at 7 kHz."""
MAX_PART_SAMPLES = 1 << 22
"""Readings of a part of a live recording: ten minutes at 7 kHz, 70 at 1 kHz, read within 1 GB of memory."""
MAX_DEFINITION_BYTES = 1 << 20
"""Bytes of a file of parameters, of a table of readings or of file names; those shipped have at most 6 kB."""
MAX_RESULT_BYTES = 1 << 23
"""Bytes of the JSON of a fit, which has about 5 kB for each recording."""

MCAP = b"\x89MCAP0\r\n"  # https://mcap.dev/spec
BAG = "metadata.yaml"  # in the folder of a ROS 2 bag
_BOM = b"\xef\xbb\xbf"  # byte order mark that some editors write before UTF-8
# the others are devices
_KINDS = {stat.S_ISDIR: "a folder", stat.S_ISFIFO: "a pipe", stat.S_ISSOCK: "a socket", stat.S_ISLNK: "a link"}
_STEPS = {"a folder": "Name a file in it.", "a link": "Name the file to which it leads."}
_OPEN = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_CREATE = os.O_RDWR | os.O_CREAT | os.O_EXCL | _NO_LINK | getattr(os, "O_BINARY", 0)

_FIRST_BYTES = 1 << 12  # of a file, that tell whether it was written anew

_MAX_TOML_DEPTH = 16  # tables within tables, or parts of a dotted key: a preset has 4
_MAX_TOML_WORD = 300  # characters of a number or a bare key: the largest float in full has 309, of which 17 count
# strings and comments, whose content does not count, then what does
_TOML_PARTS = re.compile(
    rb"(?P<text>\"\"\"(?:[^\\]|\\.)*?(?:\"{3,5}|\Z)|'''.*?(?:'{3,5}|\Z)|\"(?:[^\"\\\n]|\\.)*\"?|'[^'\n]*'?|#[^\n]*)"
    rb"|(?P<word>[\w+-]+)|(?P<dot>\.)|(?P<open>[\[{])|(?P<close>[\]}])|[ \t]+|(?P<other>.)",
    re.DOTALL,
)
# how msgspec words what a type does not have
_UNKNOWN = re.compile(
    r"(?:Object contains unknown field `(?P<key>[^`]*)`|Invalid (?:enum )?value '(?P<value>[^']*)')"
    r"(?: - at `\$(?P<place>.*)`)?"
)
_FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")  # how a spreadsheet's formula begins, quoted or not
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d+)?")


def open_regular(
    path: str | os.PathLike, what: str = "file", max_bytes: int = MAX_RECORDING_BYTES, links: bool = True
) -> BinaryIO:
    """Open a regular file of a largest size for reading; ``what`` names its kind in messages, such as ``"preset"``.
    Raises InputError if it is none, too large, not readable, or without ``links`` a link.

    Pipes and devices are refused before they are opened, because opening one can wait or act; what takes the name
    between the check and the opening is refused before it is read.
    """
    try:
        _check_regular(os.stat(path, follow_symlinks=links), path, what, max_bytes)
        file = open(os.open(path, _OPEN if links else _OPEN | _NO_LINK), "rb")
    except InputError:
        raise
    except FileNotFoundError:
        step = f"{did_you_mean(os.path.basename(path), _folder_names(path))}Check the name and the folder."
        raise InputError(what, "missing", "", str(path), step) from None
    except OSError as error:
        advice = "Check the name and its permissions."
        raise InputError(what, "not readable", error.strerror or "", str(path), advice) from None
    except ValueError as error:  # a name with a zero byte
        raise InputError(what, repr(str(path)[:80]), str(error), next_step="Check the name.") from None
    try:
        _check_regular(os.fstat(file.fileno()), path, what, max_bytes)
    except InputError:
        file.close()
        raise
    return file


def same_file(path: str | os.PathLike) -> Callable[[], AbstractContextManager[None]]:
    """A context for reading, at whose end InputError is raised if the name has another file than now, or one written
    anew, whatever else that led to; it may grow at its end."""

    def state() -> tuple[tuple[int, int], int, int, bytes]:
        with open_regular(path) as file:
            found = os.fstat(file.fileno())
            return (found.st_dev, found.st_ino), found.st_size, found.st_mtime_ns, file.read(_FIRST_BYTES)

    @contextmanager
    def reading() -> Iterator[None]:
        try:
            yield
        finally:
            now = state()
            if now != opened and not (now[0] == opened[0] and now[1] > opened[1] and now[3].startswith(opened[3])):
                limit, step = "what was read is of two files", "Read it again when it is complete."
                raise InputError("file", "changed while it was read", limit, str(path), step) from None

    opened = state()
    return reading


def leads_out(path: Path, folder: Path) -> bool:
    """Whether a path within a folder is, or goes through, a link to what is not in the folder."""
    try:
        return not path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # a link to itself
        return True


def _folder_names(path: str | os.PathLike) -> list[str]:
    """The first thousand names in the folder of a path; none where there is no folder."""
    with suppress(OSError):
        return [each.name for each in islice(os.scandir(os.path.dirname(path) or os.curdir), 1000)]
    return []


def _check_regular(found: os.stat_result, path: str | os.PathLike, what: str, max_bytes: int) -> None:
    if not stat.S_ISREG(found.st_mode):
        kind = next((name for is_kind, name in _KINDS.items() if is_kind(found.st_mode)), "a device")
        step = _STEPS.get(kind, "Save its content to a file first.")
        raise InputError(what, kind, "a regular file is needed", str(path), step)
    if found.st_size > max_bytes:
        raise _too_large(path, what, max_bytes, f"{found.st_size} bytes")


def _too_large(path: str | os.PathLike, what: str, max_bytes: int, size: str) -> InputError:
    limit = f"at most {max_bytes} bytes are read"
    return InputError(f"size of the {what}", size, limit, str(path), "Check that it is the right file, or split it.")


def check_count(what: str, count: int, limit: int, place: str | os.PathLike) -> None:
    """Raise InputError for more than a file can have."""
    if count > limit:
        step = "Save fewer of them, or split the file."
        raise InputError(f"number of {what}", count, f"at most {limit} can be read", str(place), step)


def read_bytes(path: str | os.PathLike, what: str, max_bytes: int = MAX_DEFINITION_BYTES) -> bytes:
    """The content of a file, as ``open_regular``; a file that has more bytes than the system states is refused, too."""
    with open_regular(path, what, max_bytes) as file:
        try:
            size = os.fstat(file.fileno()).st_size
            content = file.read(size + 1)
        except OSError as error:
            step = "Check the disk or the network, or copy the file."
            raise InputError(what, "not readable", error.strerror or "", str(path), step) from None
    if len(content) > size:
        raise _too_large(path, what, size, "larger than the system states")
    return content


def digest(*paths: str | os.PathLike) -> str:
    """The SHA-256 of a file, or of several as one. Raises InputError as ``open_regular``."""
    found = hashlib.sha256()
    for path in paths:
        with open_regular(path) as file:
            hashlib.file_digest(file, lambda: found)
    return found.hexdigest()


@contextmanager
def enough_memory(path: str | os.PathLike) -> Iterator[None]:
    """Convert a lack of memory, wherever it occurs within the block, into an InputError about the file."""
    try:
        yield
    except MemoryError:
        limit = "this computer, or the limit set for this program, has less than reading the file takes"
        step = "Save less in it, such as fewer columns or a coarser mesh, split the file, or read it with more memory."
        raise InputError("memory", "not enough", limit, str(path), step) from None


def read_text(path: str | os.PathLike, what: str, max_bytes: int = MAX_DEFINITION_BYTES) -> str:
    """The content of a UTF-8 file without byte order mark. Raises InputError as ``read_bytes``, and for other bytes."""
    try:
        return read_bytes(path, what, max_bytes).removeprefix(_BOM).decode("utf-8")
    except UnicodeDecodeError as error:
        limit = f"not UTF-8 at byte {error.start}"
        raise InputError(what, "not readable", limit, str(path), "Save it as UTF-8 text.") from None


def unpacked_limit(size: int) -> int:
    """Bytes to which a compressed file of ``size`` bytes may expand: measured values shrink by less than 20."""
    return (256 << 20) + 50 * size


def toml_value(value: Any) -> str:
    """A number, a text or a list as TOML has it."""
    import msgspec

    if isinstance(value, list):
        return f"[{', '.join(map(toml_value, value))}]"
    return msgspec.json.encode(value).decode() if isinstance(value, str) else repr(value)


def decode_toml(text: bytes, what: str, kind: Any = dict, next_step: str = "Correct the file at this place.") -> Any:
    """A TOML document as ``kind``, a type of msgspec.

    Nesting, dotted keys and long numbers are counted before the parser sees them: its time and memory grow with their
    square. Raises InputError, with the place, for a document that is not TOML or does not fit ``kind``.
    """
    import tomllib

    try:
        _check_toml(text)
        document = tomllib.loads(text.removeprefix(_BOM).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise InputError(what, limit=str(error), next_step=next_step) from None
    return as_type(document, kind, what, next_step)


def as_type(document: Any, kind: Any, what: str, next_step: str) -> Any:
    """A decoded document as ``kind``, a type of msgspec. Raises InputError, with the path inside it, if it does not
    fit."""
    import msgspec

    try:
        return msgspec.convert(document, type=kind)
    except (msgspec.ValidationError, OverflowError, RecursionError) as error:
        raise InputError(what, limit=str(error), next_step=_proposal(kind, str(error)) or next_step) from None


def _proposal(kind: Any, message: str) -> str:
    """The keys or values that are known where a message names one that is not; empty for another message."""
    import msgspec

    if not (found := _UNKNOWN.match(message)):
        return ""
    path = re.findall(r"\w+|\[", found["place"] or "")
    value = path.pop() if found["value"] else None
    level = _parts(msgspec.inspect.type_info(kind))
    for step in path:
        inner = [each for each in level if isinstance(each, msgspec.inspect.StructType)]
        fields = [field.type for each in inner for field in each.fields if field.encode_name == step]
        level = level if step == "[" else [part for field in fields for part in _parts(field)]
    structs = [each for each in level if isinstance(each, msgspec.inspect.StructType)]
    if value is None:
        known = dict.fromkeys(field.encode_name for each in structs for field in each.fields)
        return did_you_mean(found["key"], known).rstrip() or f"Known: {', '.join(known)}."
    known = [str(each.tag) for each in structs if each.tag_field == value]
    kinds = [part for each in structs for f in each.fields if f.encode_name == value for part in _parts(f.type)]
    known += [str(word) for kind in kinds for word in getattr(kind, "values", ())]
    return f"{did_you_mean(found['value'], known)}Known: {', '.join(known)}." if known else ""


def _parts(kind: Any) -> list:
    """The types that a type of msgspec is a choice or a list of."""
    if hasattr(kind, "types"):
        return [part for each in kind.types for part in _parts(each)]
    return _parts(kind.item_type) if hasattr(kind, "item_type") else [kind]


def _check_toml(text: bytes) -> None:
    """Raise ValueError for nesting, dotted keys or words beyond any file of parameters."""
    nested = dots = 0
    for part in _TOML_PARTS.finditer(text):
        kind = part.lastgroup
        if kind == "word" and part.end() - part.start() > _MAX_TOML_WORD:
            line = text.count(b"\n", 0, part.start()) + 1
            raise ValueError(f"a number or key of more than {_MAX_TOML_WORD} characters in line {line}")
        nested += (kind == "open") - (kind == "close" and nested > 0)
        dots = dots + 1 if kind == "dot" else 0 if kind in ("open", "close", "other") else dots
        if max(nested, dots) > _MAX_TOML_DEPTH:
            line = text.count(b"\n", 0, part.start()) + 1
            raise ValueError(f"more than {_MAX_TOML_DEPTH} tables or lists within each other in line {line}")


class _NoDocumentType(ElementTree.TreeBuilder):
    """Builds a tree, and refuses the declaration without which a document has no entities, in any encoding."""

    def doctype(self, *_: Any) -> None:
        raise ElementTree.ParseError("it declares a document type")


def xml_root(text: bytes) -> ElementTree.Element:
    """The root of an XML document. Raises ValueError if it is not XML or declares a document type or entities."""
    parser = ElementTree.XMLParser(target=_NoDocumentType())
    try:
        return ElementTree.fromstring(text, parser)
    except (ElementTree.ParseError, LookupError) as error:
        raise ValueError(str(error)) from None


def file_name(path: str | os.PathLike) -> str:
    """A path as valid text: bytes of the name that are not UTF-8 are written as ``\\xff``."""
    return os.fsencode(path).decode("utf-8", "backslashreplace")


def checked_target(path: str | os.PathLike) -> Path:
    """The file to write, links resolved; InputError if its folder does not exist or it is a folder or a device."""
    try:
        target = Path(path).resolve()
        os.path.lexists(target) or os.stat(target)
    except FileNotFoundError:
        pass
    except (OSError, ValueError, RuntimeError) as error:  # RuntimeError: a link to itself
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError("file to write", repr(str(path)[:80]), reason, next_step="Give another name.") from None
    if str(path) in ("", "."):
        raise InputError("file to write", repr(str(path)), "not the name of a file", next_step="Give a file name.")
    if not target.parent.is_dir():
        raise InputError("file", "not written", "its folder does not exist", str(target), "Make the folder first.")
    if os.path.lexists(target) and not target.is_file():
        limit = "a folder or device of this name exists"
        raise InputError("file", "not written", limit, str(target), "Give another name.")
    return target


@contextmanager
def atomic_write(path: str | os.PathLike) -> Iterator[TextIO]:
    """A temporary UTF-8 text file that replaces ``path`` when the block ends: a reader finds the old or the new file.

    The temporary file is new, of an unpredictable name in the same folder, and has the permissions of the file that it
    replaces before anything is written to it; ``file.buffer`` takes bytes. Of several writers one wins, with its
    complete file. Raises InputError if it cannot be written; after any error the old file is unchanged.
    """
    target = checked_target(path)
    part = target.with_name(f".{secrets.token_hex(8)}.part")
    try:
        with open(_created(part, target), "w", encoding="utf-8", newline="\n", errors="replace") as file:
            yield file
        os.replace(part, target)
    except OSError as error:
        raise InputError("file", "not written", error.strerror or "", str(target), "Check the folder.") from None
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def write_rows(path: str | os.PathLike, columns: Sequence[str], rows: Iterable[dict[str, Any]]) -> None:
    """Write rows as CSV, numbers with six digits, as ``atomic_write``."""
    with atomic_write(path) as file:
        file.write(",".join(columns) + "\n")
        for row in rows:
            file.write(",".join(each if isinstance(each, str) else f"{each:.6g}" for each in row.values()) + "\n")


def _created(part: Path, target: Path) -> int:
    """A descriptor of the new file ``part`` with the permissions of ``target``, or the usual ones of a new file."""
    try:
        mode = stat.S_IMODE(os.stat(target).st_mode)
    except FileNotFoundError:
        return os.open(part, _CREATE, 0o666)
    handle = os.open(part, _CREATE, 0o600)
    if hasattr(os, "fchmod"):
        os.fchmod(handle, mode)
    return handle


def csv_text(cell: str) -> str:
    """A text from outside as a cell that no spreadsheet evaluates: what would begin a formula gets an apostrophe."""
    return f"'{cell}" if _FORMULA.match(cell) and not _NUMBER.fullmatch(cell) else cell


def csv_original(cell: str) -> str:
    """The text of a cell that ``csv_text`` made, or of one that another program quoted in this way."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell) else cell


def json_safe(value: Any) -> Any:
    """The same document with None for NaN and infinite numbers, and lists for arrays and tuples."""
    if isinstance(value, dict):
        return {key: json_safe(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [json_safe(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return json_safe(value.tolist()) if hasattr(value, "tolist") else value
