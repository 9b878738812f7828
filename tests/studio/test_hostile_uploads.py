# SPDX-License-Identifier: Apache-2.0
"""Files that a page gives to the server and that bite end in words, and the server answers as before."""

import json
import struct
import time
import zipfile
import zlib
from io import BytesIO
from urllib.parse import quote

import openpyxl
import pytest
import uvicorn
from studio_server import answer, running

from needleforce.studio import server
from needleforce.studio.access import LOOPBACK, Access

FILES = {"index.html": b'<html lang="en"><meta http-equiv="Content-Security-Policy" content="default-src \'none\'">'}
SHEET = "xl/worksheets/sheet1.xml"
LAUGHS = "".join(f'<!ENTITY a{k} "{f"&a{k - 1};" * 10}">' for k in range(1, 10))


@pytest.fixture(scope="module")
def port():
    listening = server.listening_socket(0)
    app = server.make_app(FILES, Access(LOOPBACK, listening.getsockname()[1]))
    with running(uvicorn.Server(uvicorn.Config(app, http="h11", ws="none", log_level="warning")), listening) as number:
        yield number


def workbook(head: str) -> bytes:
    """A workbook whose parts begin with ``head``, and have its entity in a cell."""
    book, saved, target = openpyxl.Workbook(), BytesIO(), BytesIO()
    book.active.append(["time_s", "HERE"])
    book.save(saved)
    with zipfile.ZipFile(saved) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            text = old.read(name).decode().partition("?>")
            text = text[2] if text[1] else text[0]
            new.writestr(name, head + text.replace("HERE", "&a9;"))
    return target.getvalue()


def zip_bomb(megabytes: int) -> bytes:
    """A workbook of which one part unpacks to so many megabytes: one block of a megabyte, again and again."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(b" " * 2**20) + packer.flush(zlib.Z_FULL_FLUSH)
    data = block * megabytes + zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    sizes, name = (0, len(data), megabytes << 20, len(SHEET)), SHEET.encode()
    local = struct.pack("<4s5H3I2H", b"PK\3\4", 20, 0, 8, 0, 0, *sizes[:3], sizes[3], 0) + name
    entry = struct.pack("<4s6H3I5H2I", b"PK\1\2", 20, 20, 0, 8, 0, 0, *sizes[:3], sizes[3], 0, 0, 0, 0, 0, 0) + name
    end = struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 1, 1, len(entry), len(local) + len(data), 0)
    return local + data + entry + end


@pytest.mark.parametrize(
    "name, content",
    [
        ("bomb.xlsx", zip_bomb(3000)),
        ("laughs.xlsx", workbook(f'<!DOCTYPE a [<!ENTITY a0 "ha">{LAUGHS}]>')),
        ("outside.xlsx", workbook('<!DOCTYPE a [<!ENTITY a9 SYSTEM "file:///etc/passwd">]>')),
        ("<script>.csv", b"<script>alert(1)</script>,b\n1,2\n"),
    ],
    ids=["zip bomb", "XML bomb", "outside entity", "script"],
)
def test_a_file_that_bites_ends_in_words_and_the_server_answers_on(port, name, content):
    own, place = {"Origin": f"http://127.0.0.1:{port}"}, f"/recordings?name={quote(name, safe='')}"
    status, text, _ = answer(port, place, "POST", content, **own)
    assert status == 202 and len(content) < 4 * 2**20
    asked = json.dumps({"files": [{"key": json.loads(text)["key"]}]}).encode()
    key = json.loads(answer(port, "/fits", "POST", asked, **own)[1])["key"]
    end = time.monotonic() + 120
    while (job := json.loads(answer(port, f"/fits/{key}")[1]))["state"] in ("waiting", "running"):
        assert time.monotonic() < end
        time.sleep(0.1)
    (file,) = job["result"]["files"]
    assert job["state"] == "done" and file["state"] == "unread" and "root:" not in file["problem"]
    assert file["problem"].startswith((name.replace("<", "_").replace(">", "_"), "_script")), job
