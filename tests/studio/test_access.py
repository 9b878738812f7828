# SPDX-License-Identifier: Apache-2.0
"""Who reaches the studio: elsewhere than on loopback only who has the token. Every server here is on loopback."""

import json

import pytest
import uvicorn
from studio_server import answer, running

import needleforce as nf
from needleforce.studio import live, server
from needleforce.studio.access import Access

HOST = "rig.example"
FILES = {"index.html": b'<html lang="en"><meta http-equiv="Content-Security-Policy" content="default-src \'none\'">'}


@pytest.fixture(scope="module")
def guarded():
    """A server that was given another name than loopback's, and its access."""
    listening = server.listening_socket(0)
    access = Access.opened(HOST, listening.getsockname()[1], loopback=False)
    made = uvicorn.Server(uvicorn.Config(server.make_app(FILES, access), http="h11", ws="none", log_level="warning"))
    with running(made, listening):
        yield access


def asked(access, path="/", method="GET", body=b"", **headers):
    return answer(access.port, path, method, body, **{"Host": f"{HOST}:{access.port}"} | headers)


def test_the_printed_address_gives_a_cookie_that_only_this_page_sends(guarded):
    assert guarded.address == f"http://{HOST}:{guarded.port}/?token={guarded.token}" and len(guarded.token) >= 43
    status, _, headers = asked(guarded, f"/?token={guarded.token}")
    assert (status, headers["location"]) == (303, "/")
    first, *more = headers["set-cookie"].split("; ")
    assert {each.lower() for each in more} >= {"httponly", "samesite=strict", "path=/"}
    assert asked(guarded, Cookie=f"a=b; {first}")[0] == 200
    assert asked(guarded, Authorization=f"Bearer {guarded.token}")[0] == 200
    assert headers["referrer-policy"] == "no-referrer"


@pytest.mark.parametrize(
    "path", ["/", "/live", "/live/stream", "/recordings/a", "/?token=wrong", "/?token=", "/%2e%2e/"]
)
@pytest.mark.parametrize(
    "given", [{}, {"Cookie": "{cookie}="}, {"Cookie": "{cookie}=wrong"}, {"Authorization": "Bearer é"}]
)
def test_without_the_token_nothing_is_answered(guarded, path, given):
    headers = {name: value.format(cookie=guarded.cookie).encode("latin-1") for name, value in given.items()}
    status, text, _ = asked(guarded, path, **headers)
    assert status == 403 and b"the whole address that needleforce studio printed" in text


def test_a_token_does_not_make_another_host_or_site_the_own_one(guarded):
    own = {"Authorization": f"Bearer {guarded.token}"}
    for host in (f"127.0.0.1:{guarded.port}", f"localhost:{guarded.port}", HOST, f"evil.example:{guarded.port}"):
        assert asked(guarded, Host=host, **own)[0] == 403
    for path in ("/live/start", "/live/stop", "/recordings?name=a.csv"):
        assert asked(guarded, path, "POST", b"{}", Origin="http://evil.example", **own)[0] == 403
        assert asked(guarded, path, "POST", b"{}", **own)[0] == 403
    assert asked(guarded, "/live/stop", "POST", b"", Origin=f"http://{HOST}:{guarded.port}", **own)[0] == 202
    assert asked(guarded, "/live", **own, **{"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"})[0] == 403


def test_another_address_than_loopback_has_a_token_always():
    assert Access.opened("127.0.0.1", 1, loopback=True).token == ""
    tokens = {Access.opened("192.0.2.1", 1, loopback=False).token for _ in range(3)}
    assert len(tokens) == 3 and "" not in tokens
    assert not server.is_loopback("192.0.2.1") and server.is_loopback("::1") and server.is_loopback("127.0.0.9")


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.1", "no such name"])
def test_a_host_that_is_not_of_this_computer_is_refused(host):
    with pytest.raises(nf.InputError, match=r"Give (the name or|--host an) address"):
        server.listening_socket(0, host)


@pytest.mark.parametrize(
    "change, text",
    [({"rig": "connected"}, "rig"), ({"rig": "../rig"}, "rig"), ({"tissue": "/etc/passwd"}, "tissue"),
     ({"model": "../../model.toml"}, "model"), ({"surface": "NaN"}, "surface"), ({"surface": None}, "surface"),
     ({"motion": {"start": 0}}, "depth"), ({"motion": [1]}, "not understood")],
)  # fmt: skip
def test_a_page_names_no_rig_no_file_and_no_number_that_is_none(guarded, change, text, monkeypatch):
    monkeypatch.setattr(live, "COMMAND", ("a program that must not be started",))
    whole = {"rig": "virtual", "tissue": "paper", "model": None, "surface": 0.0, "motion": None} | change
    own = {"Authorization": f"Bearer {guarded.token}", "Origin": f"http://{HOST}:{guarded.port}"}
    for body in (json.dumps(whole).encode(), b"[" * 4000, b"x" * 5000, b"\xff"):
        status, got, _ = asked(guarded, "/live/start", "POST", body, **own)
        assert status == 409 and json.loads(got)["error"]
    assert text in json.loads(asked(guarded, "/live/start", "POST", json.dumps(whole).encode(), **own)[1])["error"]
