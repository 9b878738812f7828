# SPDX-License-Identifier: Apache-2.0
"""Labels of files from their name, a table or their card; and the files of a campaign."""

import dataclasses

import pytest
import simulated_runs as runs

import needleforce as nf
from needleforce.campaign import campaign
from needleforce.campaign.folder_files import File, find_files
from needleforce.campaign.labels import card_entries, grouped, label_files, name_pattern
from needleforce.recording.log import LogWriter

RIG = "{rig}__{specimen}_{speed_mm_s}_{angle_deg}_{needle}_{repeat}_{date}"


def fields(pattern: str, name: str) -> dict:
    found, misfit = name_pattern(pattern).read(name)
    assert not (found and misfit)
    return found


def misfit(pattern: str, name: str) -> str:
    return name_pattern(pattern).read(name)[1]


@pytest.mark.parametrize(
    "pattern, name, expected",
    [
        ("{specimen}_{repeat}", "gel_3.csv", ["gel", "3"]),
        ("{specimen}_{repeat}", "pig_liver_3.csv", ["pig_liver", "3"]),
        ("{specimen}_{repeat}.csv", "gel_3.csv", ["gel", "3"]),
        ("run_{specimen}-{repeat}_end", "run_a-b-3_end.txt", ["a-b", "3"]),
        ("{specimen}/{speed_mm_s}_{repeat}", "deep/gel/2.5_1.csv", ["gel", "2.5", "1"]),
        (RIG, "a__b__skin-on-x_2_15_3_10_2024-06-19-12-40-54.csv",
         ["a__b", "skin-on-x", "2", "15", "3", "10", "2024-06-19-12-40-54"]),
        ("{rig}__{specimen}_{repeat}", "a_b__c_d_1.csv", ["a_b", "c_d", "1"]),
    ],
)  # fmt: skip
def test_names_are_read_from_their_end(pattern, name, expected):
    assert list(fields(pattern, name).values()) == expected


@pytest.mark.parametrize(
    "pattern, name, word",
    [
        ("{specimen}_{repeat}", "gel.csv", "no '_' before {repeat} in 'gel'"),
        ("{specimen}_{repeat}", "gel_.csv", "{repeat} would be empty"),
        ("{specimen}_{repeat}", "_3.csv", "{specimen} would be empty"),
        ("run_{specimen}_{repeat}", "gel_a_3.csv", "does not begin with 'run_'"),
        ("{specimen}_{repeat}_end", "gel_3.csv", "does not end with '_end'"),
        ("{rig}/{specimen}_{repeat}", "gel_3.csv", "fewer folders"),
        ("{rig}/{specimen}_{repeat}", "a_b/gel.csv", "{repeat} would be 'b/gel', which contains '/'"),
        (RIG, "dev__setup__blank_2024-06-06-11-14-40.csv", "no '_' before {repeat} in 'dev__setup__blank'"),
        ("{rig}__{specimen}_{repeat}", "a_b__c.csv", "{repeat} would be 'b__c', which contains '__'"),
    ],
)
def test_a_mismatch_names_the_reason(pattern, name, word):
    assert fields(pattern, name) == {} and word in misfit(pattern, name)


@pytest.mark.parametrize("pattern", ["gel", "{a}{b}", "{a}_{a}", "{a_{b}", "{}_{b}", "{file}_{status}", "{1}_{b}"])
def test_an_invalid_pattern_is_refused(pattern):
    with pytest.raises(nf.InputError) as error:
        name_pattern(pattern)
    assert pattern in str(error.value) or "{status}" in pattern


def test_a_pattern_that_matches_no_file_is_named_with_an_example(tmp_path):
    (tmp_path / "gel-1.csv").write_text("")
    with pytest.raises(nf.InputError) as error:
        campaign(tmp_path, pattern="{specimen}_{repeat}")
    message = str(error.value)
    assert "{specimen}_{repeat}" in message and "gel-1.csv" in message and "no '_' before {repeat}" in message


def named(tmp_path, *names: str) -> list[File]:
    for name in names:
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).write_text("")
    return find_files(tmp_path)[0]


def cards(files: list[File]) -> dict:
    return {file.path: card_entries(file.path)[0] for file in files}


def test_folders_globs_and_lists_in_any_order(tmp_path):
    names = ["a/x.csv", "a/y.TXT", "b/z.tsv", "b/.hidden.csv", "b/notes.md", ".git/w.csv"]
    found = named(tmp_path, *names)
    assert [file.name for file in found] == ["a/x.csv", "a/y.TXT", "b/z.tsv"]
    both = [tmp_path / "b" / "z.tsv", tmp_path / "a", str(tmp_path / "*" / "x.csv")]
    assert find_files(both)[0] == find_files(both[::-1])[0] == found
    for nothing in (tmp_path / "c*", []):
        with pytest.raises(nf.InputError):
            find_files(nothing)
    (tmp_path / "c").mkdir()
    with pytest.raises(nf.InputError, match="without recordings"):
        find_files(tmp_path / "c")


def test_repeats_differ_only_in_repeat_fields(tmp_path):
    files = named(tmp_path, "gel_2_1_monday.csv", "gel_2_2_friday.csv", "gel_10_1_friday.csv", "skin_2_1_friday.csv")
    labels, _ = label_files(files, "{specimen}_{speed}_{repeat}_{date}", None, {})
    groups = [[label.file.name for label in group] for group in grouped(labels, ("repeat", "date"))]
    assert groups == [["gel_2_1_monday.csv", "gel_2_2_friday.csv"], ["gel_10_1_friday.csv"], ["skin_2_1_friday.csv"]]
    groups = grouped(labels, ("speed", "repeat", "date"))
    assert [len(group) for group in groups] == [3, 1]


def test_pattern_then_mapping_then_card(tmp_path):
    one = runs.run(1)
    carded = dataclasses.replace(one, card=dataclasses.replace(one.card, tissue="gel", needle="21 G"))
    for name in ("gel_1.csv", "mapped.csv", "carded.csv", "bare.csv"):
        nf.write(carded if name != "bare.csv" else one, tmp_path / name)
    table = tmp_path / "what.map"
    table.write_text("file;specimen;gauge\nmapped;skin;22\ngel_1.csv;other;\ngone.csv;x;y\n")
    files = find_files(tmp_path)[0]
    labels, notes = label_files(files, "{specimen}_{repeat}", table, cards(files))
    assert {label.file.name: label.fields for label in labels} == {
        "gel_1.csv": {"specimen": "gel", "repeat": "1"},
        "mapped.csv": {"specimen": "skin", "gauge": "22"},
        "carded.csv": {"needle": "21 G", "tissue": "gel"},
        "bare.csv": {},
    }
    assert len(notes) == 1 and "gone.csv" in notes[0]
    why = next(label.why for label in labels if label.file.name == "bare.csv")
    assert "{specimen}_{repeat}" in why and "it is not in the mapping" in why and "no card" in why


@pytest.mark.parametrize("ending", ["csv", "parquet", "mcap"])
def test_the_card_of_every_format_gives_fields(tmp_path, ending):
    one = runs.run(1)
    carded = dataclasses.replace(one, card=dataclasses.replace(one.card, tissue="gel", needle="21 G"))
    path = nf.write(carded, tmp_path / f"carded.{ending}")
    (label,), _ = label_files([File(path.name, path)], None, None, cards([File(path.name, path)]))
    assert label.fields == {"needle": "21 G", "tissue": "gel"}


def test_the_card_of_a_live_recording_gives_speed_and_pass(tmp_path):
    path = tmp_path / "run.mcap"
    LogWriter(path, {"tissue": "gel", "speed_mm_s": "3", "pass": "2", "site": "4"}).close({})
    (label,), _ = label_files([File(path.name, path)], None, None, cards([File(path.name, path)]))
    assert label.fields == {"tissue": "gel", "speed_mm_s": "3", "pass": "2"}


@pytest.mark.parametrize(
    "text, word",
    [
        ("name,specimen\na,b\n", "column file"),
        ("file,value\na,b\n", "value"),
        ("file,x,x\na,b,c\n", "twice"),
        ("file,x\na,b\na,c\n", "line 3"),
        ("file,x\na,b,c\n", "line 2"),
        ("", "column file"),
    ],
)
def test_a_wrong_mapping_is_refused(tmp_path, text, word):
    (tmp_path / "map.txt").write_text(text)
    with pytest.raises(nf.InputError, match=word):
        label_files([], None, tmp_path / "map.txt", {})


def test_a_missing_mapping_is_refused(tmp_path):
    with pytest.raises(nf.InputError, match="mapping"):
        label_files([], None, tmp_path / "gone.csv", {})


def test_several_fields_that_count_have_the_pattern_by_which_the_last_is_the_repeat():
    from needleforce.campaign.field_inference import infer_fields

    names = [f"liver_{specimen}_{repeat}.csv" for specimen in range(10) for repeat in range(1, 5)]
    fields, note = infer_fields(names, {})
    assert "repeat" not in fields[names[0]]
    pattern = note.partition("--pattern '")[2].partition("'")[0]
    read, _ = name_pattern(pattern).read(names[5])
    assert read["repeat"] == "2" and len(read) == 3
