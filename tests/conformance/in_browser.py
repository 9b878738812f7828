# SPDX-License-Identifier: Apache-2.0
"""The conformance set through WebAssembly in Chromium. First trace.mjs or watch.mjs, then the folder
with needleforce.mjs."""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))
from browser import chromium, served  # noqa: E402

script, folder, *cases = map(Path, sys.argv[1:])
texts = {str(path): path.read_text(encoding="utf-8") for path in cases}
with TemporaryDirectory() as place:
    shutil.copytree(folder, place, dirs_exist_ok=True)
    shutil.copy(HERE / script, Path(place, "trace.mjs"))
    Path(place, "page.html").write_text("<!DOCTYPE html><title>conformance</title>", encoding="utf-8")
    with served(Path(place)) as address, chromium() as browser:
        page = browser.new_page()
        page.goto(f"{address}page.html")
        run = 'async (cases) => (await import("./trace.mjs")).trace("./needleforce.mjs", cases)'
        sys.stdout.write(page.evaluate(run, texts))
