# SPDX-License-Identifier: Apache-2.0
"""A needle from a file of its own, or from a preset."""

from pathlib import Path

import msgspec

from ..errors import InputError
from .build import make_needle
from .schema import NeedleSection, PresetFile

OTHER_SECTIONS = {field.name for field in msgspec.structs.fields(PresetFile)} - {"needle", "reference"}


class NeedleFile(msgspec.Struct, forbid_unknown_fields=True):
    """The sections of a needle's file; ``reference`` says where its numbers come from."""

    needle: NeedleSection
    reference: str = ""


def read_needle(path):
    """The needle of a TOML file with a section ``[needle]`` and its ``[needle.tip]``; the other sections of a preset
    may follow.

    Raises InputError with the path inside the file.
    """
    import tomllib

    path = Path(path)
    try:
        document = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        document = document if "needle" in document else {"needle": document}
        known = {key: value for key, value in document.items() if key not in OTHER_SECTIONS}
        return make_needle(msgspec.convert(known, type=NeedleFile).needle)
    except InputError as error:
        raise error.at(path.name) from None
    except (OSError, UnicodeDecodeError, msgspec.ValidationError, tomllib.TOMLDecodeError) as error:
        raise InputError(
            "needle file",
            limit=str(error),
            place=path.name,
            next_step="Give a file with a [needle] section, such as a preset.",
        ) from None
