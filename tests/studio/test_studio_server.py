# SPDX-License-Identifier: Apache-2.0
"""The server of the studio answers its own page alone, and opens no path that a client gives."""

import http.client
import threading
import time
from contextlib import closing

import pytest
import uvicorn

import needleforce as nf
from needleforce.studio import page_files, server

FILES = {
    "index.html": b'<meta http-equiv="Content-Security-Policy" content="default-src \'none\'">',
    "core/a.mjs": b"1",
}


@pytest.fixture(scope="module")
def port():
    listening = server.listening_socket(0)
    number = listening.getsockname()[1]
    running = uvicorn.Server(uvicorn.Config(server.make_app(FILES, number), http="h11", ws="none", log_level="warning"))
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listening]})
    thread.start()
    while not running.started:
        time.sleep(0.01)
    yield number
    running.should_exit = True
    thread.join()


def answer(port: int, path: str = "/", method: str = "GET", **headers):
    with closing(http.client.HTTPConnection("127.0.0.1", port, timeout=10)) as connection:
        connection.putrequest(method, path, skip_host=True)
        for name, value in {"Host": f"127.0.0.1:{port}", **headers}.items():
            connection.putheader(name, value)
        connection.endheaders()
        got = connection.getresponse()
        return got.status, got.read(), got.headers


def test_the_page_is_given_under_its_own_names(port):
    for host in ("127.0.0.1", "localhost", "[::1]", "LocalHost"):
        assert answer(port, Host=f"{host}:{port}")[:2] == (200, FILES["index.html"])
    assert answer(port, "/core/a.mjs")[2]["content-type"].startswith("text/javascript")
    assert answer(port, Origin=f"http://localhost:{port}")[0] == 200


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "127.0.0.1.evil.example:{port}", ""])
def test_a_name_that_was_pointed_at_loopback_is_refused(port, host):
    status, text, _ = answer(port, Host=host.format(port=port))
    assert status == 403 and b"another host" in text


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "https://127.0.0.1:{port}", "http://localhost:1"])
def test_the_page_of_another_site_is_refused(port, origin):
    status, text, _ = answer(port, Origin=origin.format(port=port))
    assert status == 403 and b"another site" in text


@pytest.mark.parametrize(
    "path",
    [
        "/../pyproject.toml",
        "/%2e%2e/pyproject.toml",
        "/core/../index.html",
        "//etc/passwd",
        "/core",
        "/index.html%00",
        "/core/",
    ],
)
def test_no_path_of_a_client_is_opened(port, path):
    assert answer(port, path)[0] == 404


def test_nothing_can_be_sent(port):
    assert {answer(port, method=method)[0] for method in ("POST", "PUT", "DELETE", "OPTIONS")} == {405}


@pytest.mark.parametrize(("path", "headers"), [("/", {}), ("/none", {}), ("/", {"Host": "evil.example"})])
def test_every_answer_has_the_headers_of_safety(port, path, headers):
    given = answer(port, path, **headers)[2]
    assert given["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'"
    assert given["x-content-type-options"] == "nosniff" and given["referrer-policy"] == "no-referrer"
    assert given["cross-origin-resource-policy"] == "same-origin"


def test_the_page_allows_itself_no_text_as_program():
    page = (page_files.PAGE / "index.html").read_text(encoding="utf-8")
    policy = server._policy({"index.html": page.encode()})
    assert policy.startswith("default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self';")
    assert "unsafe-inline" not in policy and "'unsafe-eval'" not in policy and "http" not in policy
    assert "style=" not in page and "onclick" not in page and page.count("<script") == 1


def test_a_port_that_another_program_has_is_said(tmp_path):
    listening = server.listening_socket(0)
    with listening, pytest.raises(nf.InputError, match="give --port 0"):
        server.listening_socket(listening.getsockname()[1])


def test_an_installation_without_the_compiled_core_says_what_to_do(tmp_path):
    with pytest.raises(nf.InputError, match=r"without needleforce\.wasm, .* run make wasm"):
        page_files.page_files(tmp_path)


def test_the_tables_of_the_page_are_those_of_the_core():
    tables = page_files.tables()
    for family, laws in tables["laws"].items():
        for law in laws.values():
            for row in law["parameters"]:
                assert row["low"] <= row["start"] <= row["high"], (family, row)
    rows = {row["name"]: row for row in tables["laws"]["stiffness"]["cone"]["parameters"]}
    stated = {row["name"]: row for row in nf.laws.Cone.table()}
    for name, row in rows.items():
        assert all(row[key] == stated[name][key] for key in ("unit", "low", "high", "symbol", "meaning"))
    assert rows["half_angle"]["shown"] == "°" and rows["reduced_modulus"]["shown"] == "kPa"
    assert set(tables["presets"]) == set(nf.presets())
