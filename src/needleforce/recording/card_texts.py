# SPDX-License-Identifier: Apache-2.0
"""What a file says of itself, without its samples."""

from pathlib import Path

from .card import Preamble
from .formats import format_of
from .text_layout import find_layout


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """Those of ``keys`` that the card in a file of any format has. Raises InputError for a file that cannot be read."""
    match format_of(path):
        case "log" if path.is_file():
            from .log.card_and_end import card_and_end

            card = card_and_end(path)[0]
            return {key: card[key] for key in keys if card.get(key)}
        case "log":  # the folder of a bag: it has no card
            return {}
        case "parquet":
            from .parquet_table import find_stored

            comments = find_stored(path).comments
        case _:
            comments = find_layout(path).comments
    preamble = Preamble(comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
