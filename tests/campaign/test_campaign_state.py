# SPDX-License-Identifier: Apache-2.0
"""The same campaign to the byte, whatever does the work and however often it was stopped."""

import dataclasses
import json
import logging
import os
import signal
import subprocess
import sys

import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import campaign

module = sys.modules["needleforce.campaign.campaign"]
PATTERN = "{specimen}_{repeat}"
CONDITIONS = 6  # four specimens, and two files without a condition


@pytest.fixture
def folder(tmp_path):
    """Twelve recordings of four specimens, three damaged files, and one that is none."""
    made = tmp_path / "recordings"
    made.mkdir()
    for seed in range(12):
        nf.write(runs.run(seed, factor=1.0 + seed // 3), made / f"gel{seed // 3}_{seed % 3}.csv")
    (made / "gel0_3.csv").write_text("")
    (made / "stray.csv").write_bytes((made / "gel1_1.csv").read_bytes()[:400])
    (made / "words.csv").write_text("these are\nno numbers\n")
    (made / "notes.md").write_text("no recording")
    return made


def outputs(done, place) -> list[bytes]:
    done.save_table(place / "table.csv")
    done.report(place / "report.html")
    return [(place / "table.csv").read_bytes(), (place / "report.html").read_bytes(), done.to_json().encode()]


@pytest.fixture
def work(monkeypatch):
    """What was done in this process: the files of each condition, and the names of the files that were read."""
    done = {"conditions": [], "files": []}
    identified, facts_of = module.identified, module.facts_of

    def counted(task):
        done["conditions"].append(task.labels[0].fields.get("specimen", task.labels[0].file.name))
        return identified(task)

    def counted_files(task):
        done["files"].append(task.file.name)
        return facts_of(task)

    monkeypatch.setattr(module, "identified", counted)
    monkeypatch.setattr(module, "facts_of", counted_files)
    monkeypatch.setattr("needleforce.campaign.file_facts.SETTLED_S", -1e9)  # files made just now
    return done


def test_processes_and_state_give_the_same_bytes(folder, tmp_path):
    expected = outputs(campaign(folder, pattern=PATTERN, jobs=1), tmp_path)
    state = tmp_path / "state"
    for jobs in (2, 1):
        assert outputs(campaign(folder, pattern=PATTERN, jobs=jobs, state=state), tmp_path) == expected


@pytest.mark.long
def test_a_cluster_gives_the_same_bytes(folder, tmp_path):
    pytest.importorskip("distributed", reason="distributed is an optional extra")
    by_names = outputs(campaign(folder, jobs=1), tmp_path)  # fields by evidence, from speeds that workers measure
    assert by_names != outputs(campaign(folder, pattern=PATTERN, jobs=1), tmp_path)
    assert outputs(campaign(folder, jobs=2, scheduler="local"), tmp_path) == by_names


KILLED = """
import os, signal, sys
from needleforce.campaign import campaign

def killed(work, text):
    for number, each in enumerate(work):
        yield each
        if text == "identifying" and number == 3:
            os.kill(os.getpid(), signal.SIGKILL)

campaign(sys.argv[1], pattern=sys.argv[2], state=sys.argv[3], jobs=1, progress=killed)
"""


def test_a_campaign_that_was_killed_continues(folder, tmp_path, work, caplog):
    expected, state = outputs(campaign(folder, pattern=PATTERN), tmp_path), tmp_path / "state"
    work["conditions"].clear(), work["files"].clear()
    ended = subprocess.run([sys.executable, "-c", KILLED, folder, PATTERN, state])
    assert ended.returncode == -signal.SIGKILL
    part = campaign(None, state=state)
    kept = len(part.conditions) + len(part.others)
    assert 3 <= kept < CONDITIONS and f"{kept} of {CONDITIONS} conditions are identified so far." in part.notes
    part.report(tmp_path / "part.html")
    with caplog.at_level(logging.WARNING):
        assert outputs(campaign(folder, pattern=PATTERN, state=state), tmp_path) == expected
    assert len(work["conditions"]) == CONDITIONS - kept and "ended without leaving the folder" in caplog.text
    assert outputs(campaign(None, state=state), tmp_path) == expected


def test_ctrl_c_leaves_what_is_done(folder, tmp_path, work):
    def stopped(outcomes, text):
        for number, each in enumerate(outcomes):
            if text == "identifying" and number == 2:
                raise KeyboardInterrupt
            yield each

    with pytest.raises(KeyboardInterrupt):
        campaign(folder, pattern=PATTERN, state=tmp_path / "state", progress=stopped)
    before = len(work["conditions"])
    campaign(folder, pattern=PATTERN, state=tmp_path / "state")
    assert before == 3 and len(work["conditions"]) == before + CONDITIONS - 2


def test_only_what_changed_is_done_again(folder, tmp_path, work, caplog):
    def again(**options) -> tuple[list, list]:
        work["conditions"].clear(), work["files"].clear()
        done = campaign(folder, pattern=PATTERN, state=tmp_path / "state", **options)
        assert done.to_json() == campaign(None, state=tmp_path / "state").to_json()
        return sorted(work["conditions"]), sorted(work["files"])

    assert len(again()[0]) == CONDITIONS
    assert again() == ([], [])
    nf.write(runs.run(50, factor=2.0), folder / "gel1_0.csv")
    assert again() == (["gel1"], ["gel1_0.csv"])
    os.utime(folder / "gel2_0.csv", (0, 0))  # the same content
    assert again() == ([], ["gel2_0.csv"])
    nf.write(runs.run(51, factor=5.0), folder / "gel9_1.csv")
    assert again() == (["gel9"], ["gel9_1.csv"])
    (folder / "gel3_2.csv").unlink()
    assert again() == (["gel3"], [])
    assert not [each for each in caplog.records if each.levelno >= logging.WARNING]
    with caplog.at_level(logging.WARNING):
        assert len(again(model="paper")[0]) == CONDITIONS + 1
    assert "model was None and is now 'paper'" in caplog.text
    (folder / "needleforce.toml").write_text('description = "of this folder"\n')
    assert len(again()[1]) == 16  # how every file is read


def test_a_file_with_its_motion_in_another_file(tmp_path, work):
    one = runs.run(3)
    header = "# motion: motion.csv\ntime_s,force_N\n"
    (tmp_path / "gel_1.csv").write_text(header + "".join(f"{t},{f}\n" for t, f in zip(one.time, one.force)))

    def motion(factor: float) -> None:
        rows = "".join(f"{t},{factor * d}\n" for t, d in zip(one.time, one.depth))
        (tmp_path / "motion.csv").write_text("time_s,depth_m\n" + rows)

    for factor in (1.0, 1.1):
        motion(factor)
        done = campaign(tmp_path / "gel_1.csv", pattern=PATTERN, state=tmp_path / "state")
        assert done.recordings[0].measured["travel"].value == pytest.approx(factor * 19e-3, rel=1e-2)


def test_a_condition_that_fails_is_part_of_the_result(folder, monkeypatch):
    identified = module.identified

    def failing(task):
        if task.fields == {"specimen": "gel1"}:
            raise RuntimeError("singular")
        return identified(task)

    monkeypatch.setattr(module, "identified", failing)
    done = campaign(folder, pattern=PATTERN)
    (lost,) = [each for each in done.conditions if each.fields["specimen"] == "gel1"]
    assert lost.model is None and "RuntimeError: singular" in lost.why and len(lost.recordings) == 3
    assert sum(each.model is not None for each in done.conditions) == 3
    assert "singular" in done.table().query("file == 'gel1_0.csv'").why.iloc[0]


def test_a_folder_that_workers_do_not_have_is_refused(folder, monkeypatch):
    facts_of = module.facts_of
    monkeypatch.setattr(module, "facts_of", lambda task: dataclasses.replace(facts_of(task), is_there=False))
    with pytest.raises(nf.InputError, match=r"missing for a worker.*gel0_0|gel0_0.*missing for a worker"):
        campaign(folder, pattern=PATTERN)


def run(monkeypatch, *arguments) -> int:
    from needleforce.cli import main

    monkeypatch.setattr(sys, "argv", ["needleforce", "campaign", *map(str, arguments)])
    try:
        main()
    except SystemExit as left:
        return left.code
    return 0


def test_outputs_may_lie_in_the_folder(folder, monkeypatch):
    names = ("table.csv", "report.html", "all.json")
    given = [folder, "--pattern", PATTERN, "--state", folder / "state"]
    for option, name in zip(("--table", "--report", "--json"), names):
        given += [option, folder / name]
    assert run(monkeypatch, *given) in (0, None)
    first = [(folder / name).read_bytes() for name in names]
    assert run(monkeypatch, *given) in (0, None)
    assert [(folder / name).read_bytes() for name in names] == first
    assert {each["file"] for each in json.loads(first[2])["not_recordings"]} == {"notes.md"}
    assert run(monkeypatch, folder, "--table", folder / "gel1_0.csv") == 2  # a recording is no output


def test_an_output_that_fails_leaves_the_others(folder, tmp_path, monkeypatch, capsys):
    from needleforce.campaign import Campaign

    def full(self, path):
        raise nf.InputError("file", "not written", "No space left on device", str(path))

    monkeypatch.setattr(Campaign, "save_table", full)
    targets = ["--table", tmp_path / "t.csv", "--report", tmp_path / "r.html", "--json", "-"]
    assert run(monkeypatch, folder, "--pattern", PATTERN, *targets) == 2
    printed = capsys.readouterr()
    assert "No space left" in printed.err and (tmp_path / "r.html").stat().st_size > 5000
    assert len(json.loads(printed.out)["conditions"]) == 4


def test_the_command_shows_what_a_state_has(folder, tmp_path, monkeypatch, capsys):
    state = tmp_path / "state"
    assert run(monkeypatch, "--state", state) == 2 and "nothing kept yet" in capsys.readouterr().err
    assert run(monkeypatch) == 2
    campaign(folder, pattern=PATTERN, state=state)
    assert run(monkeypatch, "--state", state, "--report", tmp_path / "r.html") in (0, None)
    assert (tmp_path / "r.html").stat().st_size > 5000
