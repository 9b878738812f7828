# SPDX-License-Identifier: Apache-2.0
"""Settings chosen on recordings: punctures of known size among smaller falls, by hand or found."""

import json
import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.events import choose

LARGE, SMALL = 0.25, 0.12  # falls [N]: of punctures, and of what is none


def recording(seed):
    """Two punctures at 6 and 10 mm that lose 0.25 N, and a step of 0.12 N at 8 mm; 2 mm/s at 200 Hz."""
    random = np.random.default_rng(seed)
    time = np.arange(0.0, 6.0, 5e-3)
    depth = 2e-3 * time
    force = 200.0 * np.maximum(depth - 2e-3, 0.0)
    for at, fall in ((6e-3, LARGE), (8e-3, SMALL), (10e-3, LARGE)):
        force -= np.where(depth > at, fall, 0.0)
    run = nf.Recording(time=time, force=force + 2e-3 * random.standard_normal(len(time)), depth=depth)
    return run.with_events(contact=1.0, punctures=[3.0, 5.0])


@pytest.fixture(scope="module")
def chosen():
    return choose([recording(seed) for seed in range(3)], fall=(0.03, 0.1, 0.2, 0.3, 0.5), share=(0.03,),
                  false_alarms=(1e-3,))  # fmt: skip


def test_the_settings_that_separate_large_falls_from_small_ones_are_chosen(chosen):
    # reported at three quarters: 0.2 N needs 0.15 N, between the falls; 0.1 N needs 0.075 N; 0.5 N needs 0.375 N
    assert chosen.best.fall in (0.2, 0.3)
    assert (chosen.best.found, chosen.best.punctures, chosen.best.false + chosen.best.minor) == (6, 6, 0)
    rows = {row.fall: row for row in chosen.rows}
    assert rows[0.1].false + rows[0.1].minor == 3 and rows[0.1].missed == 0
    assert rows[0.5].found == 0 and math.isnan(rows[0.5].delay)
    assert 0.0 < chosen.best.delay <= 2.5 * 5e-3  # two readings
    assert chosen.held_out() == (6, 6, 0)
    assert nf.EventDetector(fall=chosen.settings.fall).settings.fall == chosen.best.fall
    assert chosen.options.startswith(f"--fall-N {chosen.best.fall:g} --fall-share 0.03")


def test_the_choice_states_what_it_is_worth_and_shows_itself(chosen, tmp_path):
    text = " ".join(str(chosen).split())
    # of 6 trials without a miss: 1 - 0.05^(1/6); of 0 alarms in 3 insertions: -ln 0.05 / 3
    assert "at most 39 %" in text and "at most 1 come" in text
    assert "6 of 6 found, 0 false" in text
    chosen.report(tmp_path / "choice.html")
    assert (tmp_path / "choice.html").read_text(encoding="utf-8").count("<svg") >= 2
    assert chosen.plot().get_xlabel() == "fall that counts as a puncture [N]"
    document = json.loads(chosen.to_json())
    assert len(document["rows"]) == len(chosen.to_dataframe()) == 5
    assert document["chosen"]["fall_N"] == chosen.best.fall


def test_recordings_without_a_puncture_are_refused():
    with pytest.raises(nf.InputError, match="with_events"):
        choose([recording(0).with_events(contact=1.0, punctures=[])])
