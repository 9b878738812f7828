#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Follows every link and picture of a folder of built pages, without the network.

    check_links.py FOLDER

A link within the folder has to lead to a file, and after # to a place that the page has; a link that leaves the folder is
a fault, for the folder is given away alone. Prints each that does not, and ends with 1 where there is one. Addresses on
the network are not asked.
"""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class Page(HTMLParser):
    """The links of a page and its places to which a link may lead."""

    def __init__(self, path: Path):
        super().__init__()
        self.links, self.places = set[str](), {"", "top"}
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        for name, value in attributes:
            if name in ("id", "name") and value:
                self.places.add(value)
            elif name in ("href", "src", "data") and value:
                self.links.add(value)


def faults(folder: Path) -> list[str]:
    """A line for each link that leads nowhere."""
    pages = {path: Page(path) for path in sorted(folder.rglob("*.html"))}
    found = []
    for path, page in pages.items():
        for link in sorted(page.links):
            parts = urlsplit(link)
            if parts.scheme or parts.netloc:
                continue
            target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not target.is_file() or not target.is_relative_to(folder):
                found.append(f"{path.relative_to(folder)}: {link} is no file of the folder")
            elif target in pages and unquote(parts.fragment) not in pages[target].places:
                found.append(f"{path.relative_to(folder)}: {link} is no place of that page")
    return found


def main() -> int:
    """Checks the folder of the command line."""
    folder = Path(sys.argv[1]).resolve()
    found = faults(folder)
    print("\n".join(found or [f"links: every one of {folder.name} leads somewhere"]))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
