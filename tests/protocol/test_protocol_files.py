# SPDX-License-Identifier: Apache-2.0
"""Protocol files: the runs of the shipped one, and what is refused."""

import re

import pytest
from small_protocol import SMALL

import needleforce as nf
from needleforce.campaign.labels import name_pattern
from needleforce.protocol import plan, protocols, read_protocol
from needleforce.protocol.protocol import name_pattern_of
from needleforce.protocol.reading import check_axis
from needleforce.rig.experiment import paper_experiment
from needleforce.wire.axis_lines import AxisRange


def read(tmp_path, text: str):
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return read_protocol(path)


def test_the_papers_protocol_has_the_runs_of_the_direct_simulation():
    runs, direct = plan(read_protocol("paper")), paper_experiment(1).runs
    wanted = sorted((run.speed, 1 + run.second, run.start_depth) for run in direct)
    assert sorted((run.speed, run.pass_number, run.moves[-1][0]) for run in runs) == wanted
    for run in runs:
        depth = 16e-3 if run.pass_number == 1 else 15.7e-3
        wanted = [depth, run.speed, depth, 1.0, -4e-3, run.speed]
        assert [number for move in run.moves for number in move] == pytest.approx(wanted)
        assert run.card["filter_length"] == str(direct[0].card.filter_length)
    for first, second in zip(runs[::2], runs[1::2]):
        assert (first.site, first.speed) == (second.site, second.speed)
    assert len({run.site for run in runs}) == 10, "each pair needs a site without a hole"
    assert "paper" in protocols()


def test_file_names_are_read_by_the_campaign(tmp_path):
    text = SMALL.replace("[16]", "[16, 12.5]").replace("spare", 'name_prefix = "gel-2_"\nspare')
    for protocol in (read_protocol("paper"), read(tmp_path, text), read(tmp_path, SMALL.replace("= 3", "= 0.05"))):
        pattern = name_pattern(name_pattern_of(protocol))
        runs = plan(protocol)
        assert len({run.name.casefold() for run in runs}) == len(runs)
        for run in runs:
            assert re.fullmatch(r"[A-Za-z0-9._-]+\.mcap", run.name)
            fields, why = pattern.read(run.name)
            assert why == "" and float(fields["speed_mm_s"]) == pytest.approx(1e3 * run.speed)
            assert (fields["repeat"], fields["pass"]) == (str(run.site), str(run.pass_number))
    assert plan(read_protocol("paper"))[0].name == "3mm_s_site1_pass1.mcap"


def test_the_example_on_the_page_is_read(root, tmp_path):
    shown = re.search(
        r"```toml\n(title.*?)```", (root / "docs" / "reference" / "protocols.md").read_text(encoding="utf-8"), re.S
    )
    assert [run.name for run in plan(read(tmp_path, shown[1]))][9] == "phantom1_3mm_s_site5_pass2.mcap"


def test_counted_sites_get_the_next_free_numbers_and_listed_ones_keep_theirs(tmp_path):
    more = "[[series]]\nspeed_mm_s = 1\nsites = [2, 7, 9, 4]\ndepths_mm = [10, 20]\n"
    protocol = read(tmp_path, SMALL + more)
    assert [each.sites for each in protocol.series] == [((1, 3),), ((2, 9), (7, 4))] and protocol.spares == (5,)
    assert [(run.site, round(1e3 * run.depth)) for run in plan(protocol)[4:]] == [(2, 10), (9, 10), (7, 20), (4, 20)]


@pytest.mark.parametrize(
    "old, new, message",
    [
        ("passes = 2", "pases = 2", r"unknown field `pases` - at `\$.series\[0\]`"),
        ("hold_s = 1", "hold_s = -1", r">= 0.* at `\$.series\[0\].hold_s`"),
        ("hold_s = 1", "pause_s = -0.1", r">= 0.*pause_s"),
        ("hold_s = 1", "hold_s = inf", r"hold_s"),
        ("hold_s = 1", "hold_s = nan", r"hold_s.*nan|hold_s"),
        ("speed_mm_s = 3", "speed_mm_s = 0", r">= 0.001"),
        ("speed_mm_s = 3", "speed_mm_s = 1e-300", r">= 0.001"),
        ('title = "', 'title = "\\u001b[2J', r"title"),
        ("speed_mm_s = 3", 'speed_mm_s = "fast"', r"Expected `float`"),
        ("sites = 2", "sites = 0", r"sites"),
        ("sites = 2", "sites = []", r"sites"),
        ("sites = 2", "sites = [1, 1]", r"site is 1, used twice"),
        ("sites = 2\ndepths_mm = [16]", "sites = 9999\ndepths_mm = [16, 12]", r"too many"),
        ("spare_sites = 1", "spare_sites = [4, 4]", r"\$.spare_sites: site is 4"),
        ("depths_mm = [16]", "depths_mm = []", r"depths_mm"),
        ("depths_mm = [16]", "depths_mm = [81]", r"\$.series\[0\].depths_mm: depth is 0.081 m, the needle is 0.08 m"),
        ("depths_mm = [16]", "depths_mm = [16, 16]", r"each depth must occur once"),
        ("depths_mm = [16]\n", "depths_mm = [0.2]\n", r"second_pass_short is 0.0003 m, .* the depth, 0.0002 m"),
        ("sites = 2\ndepths_mm = [16]", "sites = [1]\ndepths_mm = [16, 12]", r"need one site each"),
        ("start_mm = -4", "start_mm = 4", r"start_mm"),
        ("start_mm = -4", "start_mm = -4\ndeepest_mm = 10", r"\$.axis: depth is 0.016 m, the axis ends at 0.01 m"),
        ("start_mm = -4", "start_mm = -4\nmax_speed_mm_s = 2", r"\$.axis: speed is 0.003 m/s"),
        ("force_limit_N = 2", "force_limit_N = 0", r"force_limit_N"),
        ("force_limit_N = 2", "", r"missing required field `force_limit_N`"),
        ("spare_sites = 1", 'name_prefix = "../x"', r"must not leave the folder"),
        ("spare_sites = 1", 'name_prefix = "a/b"', r"must not leave the folder"),
        ("spare_sites = 1", 'name_prefix = ".hidden"', r"must not leave the folder"),
        ("spare_sites = 1", 'name_prefix = "C:"', r"must not leave the folder"),
        ("title", "=", r"mine.toml"),
    ],
)
def test_impossible_values_are_refused_with_their_place(tmp_path, old, new, message):
    assert old in SMALL
    with pytest.raises(nf.InputError, match=message) as caught:
        read(tmp_path, SMALL.replace(old, new))
    assert str(caught.value).startswith("mine.toml: ")


def test_nan_is_refused_for_every_key(tmp_path):
    for key in re.findall(r"^\w+_(?:mm|mm_s|s|N)(?= = \S+$)", SMALL, re.M):
        text = re.sub(rf"^{key} = .*$", f"{key} = nan", SMALL, flags=re.M)
        with pytest.raises(nf.InputError, match=key):
            read(tmp_path, text)


def test_invalid_files_are_refused(tmp_path):
    with pytest.raises(nf.InputError, match="paper"):
        read_protocol("papers")
    with pytest.raises(nf.InputError, match="protocol is a folder"):
        read_protocol(tmp_path)
    (tmp_path / "mine.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(nf.InputError):
        read_protocol(tmp_path / "mine.toml")
    (tmp_path / "mine.toml").write_bytes(b"x" * ((1 << 20) + 1))
    with pytest.raises(nf.InputError, match="bytes"):
        read_protocol(tmp_path / "mine.toml")


@pytest.mark.parametrize(
    "limits, message",
    [
        (AxisRange(-3e-3, 50e-3, 10e-3, 0.1), "start is -0.004 m, the axis begins at -0.003 m"),
        (AxisRange(-5e-3, 15e-3, 10e-3, 0.1), "depth is 0.016 m, the axis ends at 0.015 m"),
        (AxisRange(-5e-3, 50e-3, 2e-3, 0.1), "speed is 0.003 m/s, the axis moves at up to 0.002 m/s"),
    ],
)
def test_moves_outside_the_range_of_the_axis_are_refused(tmp_path, limits, message):
    protocol = read(tmp_path, SMALL)
    check_axis(protocol, AxisRange(-4e-3, 16e-3, 3e-3, 0.1), "the axis")
    with pytest.raises(nf.InputError, match=f"the axis: {message}"):
        check_axis(protocol, limits, "the axis")
