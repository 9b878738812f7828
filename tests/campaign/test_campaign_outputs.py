# SPDX-License-Identifier: Apache-2.0
"""Table, JSON, report and command: the same bytes for the same files in any order and folder."""

import json
import random
import re
import shutil
import sys
from html.parser import HTMLParser

import command_line
import pytest

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.campaign.result import check_table

FEW = ("speed_1.csv", "speed_2.csv", "speed_4.csv", "double_1.csv", "double_2.csv", "double_4.csv", "stray.csv",
       "double_5-empty.csv")  # fmt: skip


@pytest.fixture(scope="module")
def few(folder, tmp_path_factory):
    """A small campaign in a separate folder."""
    made = tmp_path_factory.mktemp("few")
    for name in FEW:
        shutil.copy(folder / name, made / name)
    return made


def outputs(done, place) -> list[bytes]:
    done.save_table(place / "table.csv")
    done.report(place / "report.html")
    return [(place / "table.csv").read_bytes(), (place / "report.html").read_bytes(), done.to_json().encode()]


def test_order_and_folder_of_the_files_do_not_matter(few, tmp_path):
    first = outputs(campaign(few, pattern="{specimen}_{repeat}"), tmp_path)
    moved = tmp_path / "moved"
    shutil.copytree(few, moved)
    files = [moved / name for name in FEW]
    random.Random(3).shuffle(files)
    assert files != sorted(files)
    assert outputs(campaign([*files, moved], pattern="{specimen}_{repeat}"), tmp_path) == first


def test_a_campaign_shows_itself(done):
    assert "identified" in repr(done) and "\n" not in repr(done)
    for condition in done.conditions:
        assert condition.name in str(done)
    assert "<table" in done._repr_html_() and done.to_dataframe().equals(done.table())


def test_the_table_is_tidy_and_complete(done):
    import pandas

    made = done.table()
    assert list(made.columns[:2]) == ["specimen", "repeat"]
    assert not made.duplicated(["specimen", "file", "quantity"]).any()
    assert set(made.file) == {one.file for one in done.recordings} | {""}
    for one in done.recordings:
        own = made[made.file == one.file].set_index("quantity")
        assert own.value["anomalies"] == len(one.anomalies) and bool(own.outlier["anomalies"]) == bool(one.anomalies)
        for name, estimate in one.parameters.items() if one.has_parameters else ():
            assert own.value[name] == estimate.value or estimate.value != estimate.value
            assert {"event_contact_depth", "event_puncture_1_force", "speed", "travel", "hold"} <= set(own.index)
    pooled = made[(made.file == "") & (made.specimen == "speed")].set_index("quantity")
    (condition,) = [each for each in done.conditions if each.fields["specimen"] == "speed"]
    assert pooled.low["friction_per_length"] == condition.parameters["friction_per_length"].low
    assert pooled.value["recordings"] == 2
    assert isinstance(made, pandas.DataFrame)


def test_events_are_within_their_bounds(done):
    made = done.table()
    events = made[made.quantity.str.fullmatch(r"event_(contact|exit|puncture_\d)_depth")]
    found = events[events.status == "ok"]
    assert len(found) > 60 and (found.low <= found.high).all()
    assert ((found.low - 1e-4 <= found.value) & (found.value <= found.high + 1e-4)).all()


def test_an_anomalous_quantity_is_flagged_in_its_row(done):
    made = done.table().set_index(["file", "quantity"])
    anomaly = {"speed": "speed", "travel": "travel", "drift": "drift", "outlier": "puncture_indentation"}
    for specimen, quantity in (anomaly | {"unpierced": "event_punctures"}).items():
        row = made.loc[(f"{specimen}_4.csv", quantity)]
        assert row.outlier and row.why, (specimen, quantity)
    assert not made.loc[("speed_1.csv", "speed")].outlier


def test_csv_reads_back(done, tmp_path):
    import pandas

    done.save_table(tmp_path / "table.csv")
    back = pandas.read_csv(tmp_path / "table.csv", keep_default_na=False, na_values={"value": [""], "low": [""]})
    assert list(back.columns) == list(done.table().columns) and len(back) == len(done.table())


def test_parquet_reads_back(done, tmp_path):
    pytest.importorskip("pyarrow", reason="pyarrow is an optional extra")
    import pandas

    done.save_table(tmp_path / "table.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "table.parquet"), done.table(), check_dtype=False)
    assert [path.name for path in tmp_path.iterdir()] == ["table.parquet"]


def test_parquet_without_pyarrow_names_the_extra(done, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    for save in (done.save_table, check_table):
        with pytest.raises(nf.InputError, match=r"needleforce\[parquet\]"):
            save(tmp_path / "table.parquet")
    assert not list(tmp_path.iterdir())


CURVES = ("#88929b", "#c64f00", "#0072b2", "#a3428a", "#00735c", "#6a4fb3")  # repeats, models, anomalous repeats


class Page(HTMLParser):
    """Ids, links within the page, external resources, and curves."""

    def __init__(self, text: str):
        super().__init__()
        self.ids, self.links, self.foreign, self.lines = set(), set(), [], 0
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.ids |= {given["id"]} if "id" in given else set()
        target = given.get("href") or given.get("src") or ""
        self.links |= {target[1:]} if target.startswith("#") else set()
        self.foreign += [target] if target and not target.startswith("#") else []
        self.lines += tag == "path" and any(f"stroke: {colour}" in given.get("style", "") for colour in CURVES)


def test_the_report_shows_every_repeat_and_every_reason(done, tmp_path):
    done.report(tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.links <= page.ids and not page.foreign
    off_axes = len(re.findall(r"Outside the axes: no\. \d+", text))
    drawn = sum(one.shown is not None for condition in done.conditions for one in condition.recordings)
    assert page.lines == drawn - off_axes + sum(each.model is not None for each in done.conditions)
    for one in done.recordings:
        assert one.file in text
        for anomaly in one.anomalies:
            assert anomaly.sentence.split("'")[0] in text


def test_the_report_states_a_reason_once_after_the_tables(tmp_path):
    for name in ("a_1.csv", "a_2.csv", "b_1.csv"):
        (tmp_path / name).write_bytes(b"time_s,depth_mm\n0,")
    campaign(tmp_path, pattern="{gel}_{repeat}").report(tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert text.count("o column holds the force") == 1 and text.count('href="#reason-1"') == 2 + 3  # panels, recordings
    assert text.index("</table>", text.index("b_1.csv")) < text.index("o column holds the force")


def test_a_large_report_stays_small(done, tmp_path):
    import dataclasses

    valid = [one for one in done.recordings if one.pooled and not one.anomalies]
    one = next(each for each in done.conditions if each.model is not None)
    renamed = [dataclasses.replace(valid[k % len(valid)], file=f"{k}.csv") for k in range(300)]
    many = [
        dataclasses.replace(one, fields={"k": str(k)}, recordings=tuple(renamed[k : k + 5])) for k in range(0, 300, 5)
    ]
    dataclasses.replace(done, conditions=tuple(many), others=()).report(tmp_path / "report.html")
    assert 100_000 < (tmp_path / "report.html").stat().st_size < 5_000_000


def test_a_report_without_curves_is_written(folder, tmp_path):
    nothing = campaign(folder / "double_5-empty.csv")
    nothing.report(tmp_path / "report.html")
    nothing.save_table(tmp_path / "table.csv")
    assert "double_5-empty.csv" in (tmp_path / "report.html").read_text(encoding="utf-8")


def run(*arguments):
    return command_line.run("campaign", *arguments)


def test_the_command(few, tmp_path):
    table, report = tmp_path / "t.csv", tmp_path / "r.html"
    done = run(few, "--pattern", "{specimen}_{repeat}", "--table", table, "--report", report, "--json", "-")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert {each["name"] for each in document["conditions"]} == {"speed", "double"}
    assert sum(len(each["recordings"]) for each in document["conditions"]) + len(document["others"]) == len(FEW)
    assert table.stat().st_size > 1000 and report.stat().st_size > 5000
    again = [table, report, *sorted(few.iterdir())]  # as a shell expands the folder after the first run
    state = few.parent / "state"
    for _ in range(2):
        done = run(*again, *([state] if state.is_dir() else []), "--state", state, "--table", table, "--json", "-")
        assert done.returncode == 0, done.stderr
    for word in ("has another motion", "double_5-empty.csv", "left out", "stray.csv", "of the repeats used"):
        assert word in done.stderr


def exit_code(monkeypatch, *arguments) -> int:
    from needleforce.cli import main

    monkeypatch.setattr(sys, "argv", ["needleforce", "campaign", *map(str, arguments)])
    with pytest.raises(SystemExit) as left:
        main()
    return left.value.code


def test_exit_codes(few, monkeypatch, capsys):
    assert exit_code(monkeypatch, few / "double_5-empty.csv") == 1
    assert exit_code(monkeypatch, few / "stray.csv", few / "double_5-empty.csv") == 0
    assert exit_code(monkeypatch, few, "--pattern", "{a}={b}") == 2
    assert "{a}={b}" in capsys.readouterr().err
    assert exit_code(monkeypatch, few, "--table", few / "stray.csv") == 2
    assert "also read" in capsys.readouterr().err
    assert exit_code(monkeypatch, few, "--unit", "force=parsec") == 2
    assert exit_code(monkeypatch, few / "nothing*") == 2
