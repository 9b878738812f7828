# SPDX-License-Identifier: Apache-2.0
"""A tissue from a file of its own, or from a preset."""

from pathlib import Path

import msgspec

from ..errors import InputError
from .build import make_tissue
from .schema import TissueSection


def read_tissue(path, required: bool = True):
    """The tissue of a TOML file with a section ``[tissue]``; other sections, as of a preset, are passed over.

    None where there is no such section and it is not ``required``. Raises InputError with the path inside the file.
    """
    import tomllib

    path = Path(path)
    try:
        section = tomllib.loads(path.read_text(encoding="utf-8-sig")).get("tissue")
        if section is None and required:
            raise InputError("section [tissue]", "missing", next_step="Give a file or preset that has one.")
        return None if section is None else make_tissue(msgspec.convert(section, type=TissueSection))
    except InputError as error:
        raise error.at(path.name) from None
    except (OSError, UnicodeDecodeError, msgspec.ValidationError, tomllib.TOMLDecodeError) as error:
        next_step = "Give a file with a [tissue] section, such as a preset that has one."
        raise InputError("tissue file", limit=str(error), place=path.name, next_step=next_step) from None
