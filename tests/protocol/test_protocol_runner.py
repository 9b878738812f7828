# SPDX-License-Identifier: Apache-2.0
"""A campaign over several sessions with interruptions: the files, their sites, and the printed text.

Recorder and axis are replaced by test doubles that write real files with the depth of the needle.
"""

import csv
import os
import shlex

import pytest
from small_protocol import SMALL

import needleforce as nf
from needleforce.acquisition.settings import Settings
from needleforce.campaign.labels import read_mapping
from needleforce.protocol import plan, read_protocol, run_protocol
from needleforce.protocol.folder import locked
from needleforce.recording.log import LogWriter
from needleforce.recording.log.reader import card_and_end
from needleforce.wire.axis_lines import AxisRange

TEXT = SMALL.replace("two", "three").replace("sites = 2", "sites = 3")
TEXT = TEXT.replace("hold_s = 1\n", "").replace("second_pass_short_mm = 0.3\n", "")
SETTINGS = Settings(force_limit=1.0)


class Axis:
    """Goes to a site at once."""

    limits = AxisRange(-10e-3, 60e-3, 10e-3, 0.1)

    def __init__(self, rig):
        self.rig = rig

    def site(self, number):
        if self.rig.no_sites:
            raise nf.InputError("site", number, "refused")
        assert self.rig.depth < 0.0, "the needle is in the tissue"
        self.rig.calls.append(("site", number))

    def close(self):
        pass


class Rig:
    """Sources and a recorder; ``ends`` gives the reason and the depth [m] at the end of the n-th run."""

    def __init__(self, monkeypatch):
        self.depth, self.calls, self.ends, self.settings, self.moves = -4e-3, [], {}, [], []
        self.no_sites, self.unconfirmed = False, ()
        self.runs = 0
        monkeypatch.setattr("needleforce.acquisition.recorder.record_run", self.record)

    def open(self):
        return type("Force", (), {"stop": lambda self: None})(), Axis(self)

    def record(self, path, force, axis, moves, card, settings, *, view=None, stop=None, when_withdrawn=None):
        if self.depth > moves[0][0]:
            self.depth = moves[0][0]
            self.calls.append(("withdrawn", self.depth))
        when_withdrawn()
        self.runs += 1
        self.settings.append(settings)
        why, depth = self.ends.pop(self.runs, ("done", None))
        writer = LogWriter(path, card)
        deepest = moves[1][0] if depth is None else depth
        for k, each in enumerate((-4e-3, deepest)):
            writer.wrench(k, k, k, k, [0.0] * 6)
            writer.state(k, k, k, k, each, 0.0)
        writer.flush()
        self.depth = deepest if why != "done" else -4e-3
        flushed = path.read_bytes()
        writer.close({"ended": why})
        if why == "killed":
            path.write_bytes(flushed)
            raise KeyboardInterrupt
        confirmed = why != "axis silent" and self.runs not in self.unconfirmed
        return type("Outcome", (), {"ended": why, "detail": "as given.", "rest_confirmed": confirmed})()


@pytest.fixture
def rig(monkeypatch):
    return Rig(monkeypatch)


@pytest.fixture
def protocol(tmp_path):
    (tmp_path / "mine.toml").write_text(TEXT, encoding="utf-8")
    return read_protocol(tmp_path / "mine.toml")


@pytest.fixture
def session(rig, protocol, tmp_path):
    """A session in the folder ``out``: its outcome and the printed text."""

    def run(**options):
        sentences: list[str] = []
        done = run_protocol(protocol, tmp_path / "out", rig.open, SETTINGS, say=sentences.append, **options)
        return done, "\n".join(sentences)

    return run


def names(tmp_path) -> set[str]:
    return {path.name.removeprefix("3mm_s_").removesuffix(".mcap") for path in (tmp_path / "out").glob("*.mcap")}


def pairs(*sites: int) -> set[str]:
    return {f"site{site}_pass{number}" for site in sites for number in (1, 2)}


def test_every_run_is_recorded_once(rig, session, protocol, tmp_path):
    done, _ = session()
    assert (done.ended, done.complete, done.present, done.planned) == ("done", True, 6, 6)
    assert list(done.recorded) == [run.name for run in plan(protocol)] and names(tmp_path) == pairs(1, 2, 3)
    assert [each for each in rig.calls if each[0] == "site"] == [("site", 1), ("site", 2), ("site", 3)]
    assert {each.force_limit for each in rig.settings} == {1.0}, "the lower of two limits is used"
    again, _ = session()
    assert (again.complete, again.recorded, rig.runs) == (True, (), 6)


def test_cards_describe_the_run_the_site_and_the_protocol_file(rig, session, protocol, tmp_path):
    session()
    card, end = card_and_end(tmp_path / "out" / "3mm_s_site2_pass1.mcap")
    assert end == {"ended": "done"}
    assert card.pop("date").endswith("+00:00")
    assert card == {
        "needle": "diameter 0.7 mm, length 80 mm, bevel", "tissue": "gel", "rig": "", "protocol": "three sites",
        "protocol_sha256": protocol.sha256, "filter_length": "1", "axial": "fz", "site": "2", "pass": "1",
        "speed_mm_s": "3", "depth_mm": "16", "hold_s": "0",
    }  # fmt: skip


@pytest.mark.parametrize("why", ["interrupted", "force limit", "axis silent", "killed"])
@pytest.mark.parametrize("number", range(1, 7))
def test_a_site_interrupted_in_the_tissue_is_replaced_by_a_spare_one(rig, session, tmp_path, number, why):
    rig.ends[number] = (why, 5e-3)
    broken, text = session()
    assert not broken.complete and "same command" in text and broken.present == number - 1
    assert broken.rest_confirmed is (why != "axis silent")
    done, text = session()
    site, of_pair = divmod(number - 1, 2)
    interrupted = f"site{site + 1}_pass{of_pair + 1}"
    kept = {f"site{site + 1}_pass1"} if of_pair else set()
    assert done.complete and done.present == 6
    others = {1, 2, 3} - {site + 1}
    assert names(tmp_path) == pairs(*others, 4) | kept | {f"{interrupted}_interrupted1"}
    assert "replaced by site 4" in text
    card, _ = card_and_end(tmp_path / "out" / "3mm_s_site4_pass2.mcap")
    assert (card["site"], card["replaces"]) == ("4", str(site + 1))


def test_a_site_interrupted_above_the_tissue_is_used_again(rig, session, tmp_path):
    rig.ends = {1: ("interrupted", -3.9e-3), 2: ("sensor silent", -3.9e-3), 5: ("killed", -4e-3)}
    assert [session()[0].complete for _ in range(4)] == [False, False, False, True]
    wanted = pairs(1, 2, 3) | {"site1_pass1_interrupted1", "site1_pass1_interrupted2", "site2_pass1_interrupted1"}
    assert names(tmp_path) == wanted


@pytest.mark.parametrize("depth, again", [(-3.5e-3, True), (-1.5e-3, False), (-0.5e-3, False)])
def test_travel_after_the_last_flush_counts_as_possible_contact(rig, session, tmp_path, depth, again):
    """At 3 mm/s a needle can move 2.25 mm in the 0.75 s before its axis stops by itself; 1 mm may be tissue."""
    rig.ends[1] = ("killed", depth)
    session()
    session()
    assert ("site1_pass1" in names(tmp_path)) is again


def test_the_needle_is_withdrawn_first(rig, session):
    rig.ends[2] = ("force limit", 9e-3)
    session()
    assert rig.depth == 9e-3
    rig.calls.clear()
    session()
    assert rig.calls[:2] == [("withdrawn", -4e-3), ("site", 4)]


def spoil_two(rig, session):
    rig.ends = {1: ("interrupted", 5e-3), 2: ("interrupted", 5e-3)}
    session()
    session()


def test_without_a_spare_site_the_others_are_recorded_and_the_end_is_reported(rig, session, tmp_path):
    spoil_two(rig, session)
    done, text = session()
    assert (done.ended, done.complete, done.present) == ("sites unusable", False, 4)
    assert "--same-site" in text and names(tmp_path) >= pairs(2, 3)
    assert rig.runs == 6
    assert session()[0].recorded == ()


@pytest.mark.parametrize("how", [{"same_site": True}, {"ask": lambda question: True}])
def test_on_request_a_run_uses_the_hole_and_its_card_states_it(rig, session, tmp_path, how):
    spoil_two(rig, session)
    done, _ = session(**how)
    assert done.complete and names(tmp_path) >= pairs(2, 3, 4)
    card, _ = card_and_end(tmp_path / "out" / "3mm_s_site4_pass1.mcap")
    assert "pierced" in card["same_site"]


def test_a_site_is_left_out_if_the_operator_declines(rig, session):
    spoil_two(rig, session)
    asked = []
    done, _ = session(ask=lambda question: asked.append(question))
    assert done.ended == "sites unusable" and len(asked) == 1 and "hole" in asked[0]


def test_a_second_pass_without_a_spare_site_leaves_the_first_without_a_pair(rig, session, tmp_path):
    rig.ends = {1: ("interrupted", 5e-3), 3: ("interrupted", 5e-3)}
    session()
    session()
    done, text = session()
    assert done.ended == "sites unusable" and "remains without a pair" in text
    assert names(tmp_path) >= pairs(2, 3) | {"site4_pass1"}
    command = next(line for line in done.commands if " identify " in line)
    assert "site4" not in command


def test_an_axis_without_sites_needs_an_operator(rig, session):
    rig.no_sites = True
    with pytest.raises(nf.InputError, match="cannot go there"):
        session()
    asked = []
    done, _ = session(ask=lambda question: not asked.append(question))
    assert done.complete and [question.split("site ")[1][0] for question in asked] == ["1", "2", "3"]
    assert session(ask=lambda question: False)[0].complete


def test_an_operator_who_declines_ends_the_session(rig, session):
    rig.no_sites = True
    done, text = session(ask=lambda question: False)
    assert (done.ended, done.recorded) == ("interrupted", ()) and "same command" in text


def test_the_folder_of_another_protocol_is_refused(rig, session, protocol, tmp_path):
    session()
    before = names(tmp_path)
    (tmp_path / "mine.toml").write_text(TEXT + "# another file\n", encoding="utf-8")
    other = read_protocol(tmp_path / "mine.toml")
    with pytest.raises(nf.InputError, match="three sites"):
        run_protocol(other, tmp_path / "out", rig.open, SETTINGS, say=lambda text: None)
    assert names(tmp_path) == before


def test_a_folder_in_use_by_another_session_is_refused(rig, session, protocol, tmp_path):
    (tmp_path / "out").mkdir()
    with locked(tmp_path / "out"), pytest.raises(nf.InputError, match="another session"):
        session()
    assert session()[0].complete and rig.runs == 6


def test_moves_outside_the_range_of_the_axis_are_refused_before_the_start(rig, session, monkeypatch):
    monkeypatch.setattr(Axis, "limits", AxisRange(-10e-3, 15e-3, 10e-3, 0.1))
    with pytest.raises(nf.InputError, match="the axis ends at"):
        session()
    assert rig.calls == [] and rig.runs == 0


def test_the_campaign_reads_the_table(rig, session, tmp_path):
    rig.ends[3] = ("interrupted", 5e-3)
    session()
    session()
    table = read_mapping(tmp_path / "out" / "campaign.csv")
    assert {name.removeprefix("3mm_s_").removesuffix(".mcap") for name in table} == pairs(1, 3, 4)
    row = table["3mm_s_site4_pass2.mcap"]
    del row["date"]
    assert row == {"specimen": "gel", "speed_mm_s": "3", "depth_mm": "16", "hold_s": "0", "pass": "2", "repeat": "4"}
    with open(tmp_path / "out" / "campaign.csv", encoding="utf-8") as file:
        assert len(list(csv.reader(file))) == 7


def test_the_command_pairs_first_and_second_passes(rig, session, tmp_path):
    rig.ends[4] = ("interrupted", 5e-3)
    session()
    done, text = session()
    words = shlex.split(done.commands[0])
    assert words[:2] == ["needleforce", "identify"] and done.commands[0] in text
    firsts = [os.path.basename(word) for word in words[2:5]]
    seconds = [os.path.basename(word) for flag, word in zip(words[5::2], words[6::2]) if flag == "--second-pass"]
    assert firsts == [f"3mm_s_site{site}_pass1.mcap" for site in (1, 4, 3)]
    assert seconds == [name.replace("pass1", "pass2") for name in firsts] and len(words) == 11
    assert all(os.path.exists(word) for word in words[2:] if word != "--second-pass")


@pytest.mark.parametrize(
    "content", [b"", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n\x0c\xff\xff\xff\xff\xff\xff\xff\x7f", b"no"]
)
def test_a_file_without_a_card_is_renamed_and_kept(rig, session, tmp_path, content):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "3mm_s_site1_pass1.mcap").write_bytes(content)
    (tmp_path / "out" / "other.mcap").write_bytes(content)
    done, _ = session()
    assert done.complete and (tmp_path / "out" / "3mm_s_site1_pass1_interrupted1.mcap").read_bytes() == content
    assert (tmp_path / "out" / "other.mcap").read_bytes() == content


def test_the_second_pass_begins_after_the_pause(rig, tmp_path, monkeypatch):
    (tmp_path / "slow.toml").write_text(TEXT.replace("sites = 3", "sites = 1\npause_s = 0.15"), encoding="utf-8")
    slept = []
    monkeypatch.setattr("needleforce.protocol.session.time.sleep", slept.append)
    run_protocol(read_protocol(tmp_path / "slow.toml"), tmp_path / "out", rig.open, SETTINGS, say=lambda text: None)
    assert slept == [0.15]


def test_a_session_ends_with_a_run_whose_axis_was_not_seen_to_stop(rig, session):
    rig.unconfirmed = (2,)
    done, _ = session()
    assert (done.ended, done.rest_confirmed, len(done.recorded), done.complete) == (
        "axis did not stop",
        False,
        2,
        False,
    )
