# SPDX-License-Identifier: Apache-2.0
"""The server of the studio answers its own page alone, and opens no path that a client gives."""

import asyncio
import json
import re
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from urllib.parse import quote

import pytest
import uvicorn
from studio_server import answer, running

import needleforce as nf
from needleforce.studio import access, live, page_files, recording_jobs, server
from needleforce.studio.reading_choices import FileChoices, FitChoices

SLOW = (sys.executable, "-c", "import time; time.sleep(60)")
FILES = {
    "index.html": b'<meta http-equiv="Content-Security-Policy" content="default-src \'none\'">',
    "core/a.mjs": b"1",
}


@pytest.fixture
def port():
    listening = server.listening_socket(0)
    app = server.make_app(FILES, access.Access(access.LOOPBACK, listening.getsockname()[1]))
    made = uvicorn.Server(uvicorn.Config(app, http="h11", ws="none", log_level="warning"))
    with running(made, listening) as number:
        yield number


@pytest.fixture
def slow(monkeypatch):
    monkeypatch.setattr(recording_jobs, "COMMAND", SLOW)


def wait_for(condition):
    for _ in range(600):
        if condition():
            return
        time.sleep(0.05)
    pytest.fail("it does not happen")


def sent(port: int, body: bytes = b"1", name: str = "a.csv"):
    """Status and answer to a recording from the page itself."""
    status, text, _ = answer(
        port, f"/recordings?name={quote(name, safe='')}", "POST", body, Origin=f"http://127.0.0.1:{port}"
    )
    return status, json.loads(text)


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


def test_nothing_is_sent_to_another_place(port):
    own = {"Origin": f"http://127.0.0.1:{port}"}
    assert {answer(port, method=method, **own)[0] for method in ("POST", "PUT", "DELETE", "OPTIONS")} == {405}
    assert answer(port, "/recordings", "PUT", **own)[0] == 405


@pytest.mark.parametrize("origin", [{}, {"Origin": "http://evil.example"}, {"Origin": "null"}])
def test_another_site_sends_no_recording(port, origin):
    assert answer(port, "/recordings?name=a.csv", "POST", b"1", **origin)[0] == 403
    assert answer(port, "/fits", "POST", b"{}", **origin)[0] == 403
    assert answer(port, "/fits/a", "DELETE", **origin)[0] == 403


def started(port: int, *keys: str, **more):
    """Status and answer to a fit of files with these keys, as the page asks for it."""
    body = json.dumps({"files": [{"key": key} for key in keys], **more}).encode()
    status, text, _ = answer(port, "/fits", "POST", body, Origin=f"http://127.0.0.1:{port}")
    return status, json.loads(text)


def test_few_fits_run_at_a_time_and_end_when_they_are_cancelled(port, slow):
    file = sent(port)[1]["key"]
    keys = [started(port, file)[1]["key"] for _ in range(4)]
    state = lambda key: json.loads(answer(port, f"/fits/{key}")[1])["state"]  # noqa: E731
    wait_for(lambda: [state(key) for key in keys] == ["running", "running", "waiting", "waiting"])
    own = {"Origin": f"http://127.0.0.1:{port}"}
    assert json.loads(answer(port, f"/fits/{keys[0]}", "DELETE", **own)[1])["state"] == "cancelled"
    wait_for(lambda: [state(key) for key in keys] == ["cancelled", "running", "running", "waiting"])
    assert answer(port, f"/fits/{keys[0]}/report")[0] == 404
    assert answer(port, "/fits/none")[0] == 404


def test_places_are_limited_and_a_finished_one_makes_room(port, slow, monkeypatch):
    monkeypatch.setattr(recording_jobs, "MAX_KEPT", 2)
    file = sent(port)[1]["key"]
    keys = [started(port, file)[1]["key"] for _ in range(2)]
    status, found = started(port, file)
    assert status == 422 and "all of them wait or run" in found["error"]
    answer(port, f"/fits/{keys[0]}", "DELETE", Origin=f"http://127.0.0.1:{port}")
    assert started(port, file)[0] == 202 and answer(port, f"/fits/{keys[0]}")[0] == 404


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        ({"files": [{"key": "../../etc/passwd"}]}, 404),
        ({"files": [{"key": "KEY", "motion": "/etc/passwd"}]}, 404),
        ({"files": [{"key": "KEY", "options": {"mapping": "/etc/passwd"}}]}, 422),
        ({"files": [{"key": "KEY", "options": {"motion": "/etc/passwd"}}]}, 422),
        ({"files": [{"key": "KEY", "options": {"rate_hz": "fast"}}]}, 422),
        ({"files": [{"key": "KEY", "path": "/etc/passwd"}]}, 422),
        ({"files": [{"key": "KEY"}], "needle": "/etc/passwd"}, 422),
        ({"files": [{"key": "KEY"}], "model": "../paper.toml"}, 422),
        ({"files": [{"key": "KEY"}], "task": "delete"}, 422),
        ({"files": []}, 422),
    ],
)
def test_only_what_the_page_offers_is_taken(port, slow, asked, status):
    key = sent(port)[1]["key"]
    body = json.dumps(asked).replace("KEY", key).encode()
    got, text, _ = answer(port, "/fits", "POST", body, Origin=f"http://127.0.0.1:{port}")
    assert got == status and json.loads(text)["error"]


def of_its_own_loop(made):
    with ThreadPoolExecutor() as other:  # a browser of other tests has a loop in this thread
        return other.submit(lambda: asyncio.run(made())).result()


async def pieces(*parts):
    for part in parts:
        yield part


def test_a_recording_has_a_limit_and_its_name_stays_in_its_folder(slow, monkeypatch):
    monkeypatch.setattr(recording_jobs, "MAX_BYTES", 1000)
    names = ("../../etc/passwd", "/etc/passwd", "..", "", "a\0b", "-rf", "result.json", "needleforce.toml", "A.csv",
             "a.csv", "ä" * 300 + ".csv")  # fmt: skip

    async def all_of_it():
        jobs = recording_jobs.RecordingJobs()
        with pytest.raises(nf.InputError, match="too long for the page"):
            await jobs.receive("a.csv", pieces(*[b"1" * 400] * 3))
        assert list(jobs.folder.iterdir()) == []
        keys = [await jobs.receive(name, pieces(b"1")) for name in names]
        job = jobs.jobs[jobs.start(FitChoices(files=[FileChoices(key=key) for key in keys]))]
        files = [path for path in job.folder.iterdir() if path.name != recording_jobs.REQUEST]
        assert len(files) == len(names) and job.folder.parent == jobs.folder
        for file in files:
            assert file.read_bytes() == b"1" and file.name not in recording_jobs.OWN_NAMES
            assert file.name == re.sub(r"[^A-Za-z0-9_.-]", "", file.name) and not file.name.startswith(("-", "."))
        await asyncio.sleep(0.2)
        await jobs.close()
        assert not jobs.folder.exists() and job.process.returncode is not None

    of_its_own_loop(all_of_it)


def test_what_nobody_asks_for_is_ended_and_forgotten(slow, monkeypatch):
    async def all_of_it():
        jobs = recording_jobs.RecordingJobs()
        keys = [await jobs.receive("a.csv", pieces(b"1" * 10)) for _ in range(2)]
        fit = jobs.start(FitChoices(files=[FileChoices(key=keys[0])]))
        await asyncio.sleep(0.2)
        job = jobs.jobs[fit]
        jobs.sweep(job.asked + recording_jobs.ABANDONED_S - 1)
        assert job.state == "running"
        jobs.sweep(job.asked + recording_jobs.ABANDONED_S + 1)
        await job.task
        assert job.state == "cancelled" and job.process.returncode is not None
        jobs.sweep(job.asked + recording_jobs.FORGOTTEN_S + 60)
        assert not jobs.jobs and not jobs.uploads and list(jobs.folder.iterdir()) == []
        monkeypatch.setattr(recording_jobs, "MAX_TOTAL_BYTES", 25)
        keys = [await jobs.receive("a.csv", pieces(b"1" * 10)) for _ in range(3)]
        assert list(jobs.uploads) == keys[1:]  # the one that was not used for longest made room
        await jobs.close()

    of_its_own_loop(all_of_it)


def test_what_is_ended_while_its_process_begins_leaves_none(slow, monkeypatch, tmp_path):
    monkeypatch.setattr(live, "COMMAND", SLOW)
    exec_as_usual, begun = asyncio.create_subprocess_exec, []

    async def all_of_it():
        ended = asyncio.Event()

        async def begins(*command, **options):
            process = await exec_as_usual(*command, **options)
            begun.append(process)
            await ended.wait()
            return process

        monkeypatch.setattr(asyncio, "create_subprocess_exec", begins)
        async with asyncio.timeout(30):
            jobs, watched = recording_jobs.RecordingJobs(), live.Live(live.Setup(folder=tmp_path))
            key = await jobs.receive("a.csv", pieces(b"1"))
            job = jobs.jobs[jobs.start(FitChoices(files=[FileChoices(key=key)]))]
            start = asyncio.create_task(watched.start({"rig": "virtual", "tissue": "paper", "surface": 0.0}))
            while len(begun) < 2:
                await asyncio.sleep(0.01)
            jobs.cancel(job)
            await watched.close()
            ended.set()
            await asyncio.gather(job.task, start)
        left = [process for process in begun if process.returncode is None]
        for process in left:
            process.kill()
        assert not left and job.state == "cancelled"
        await jobs.close()

    of_its_own_loop(all_of_it)


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
