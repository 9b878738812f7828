# SPDX-License-Identifier: Apache-2.0
"""Every fault occurs as often as requested, and the ground truth lists exactly the affected records."""

from itertools import pairwise

import numpy as np
import pytest

from needleforce import InputError
from needleforce.rig.live import FAULTS, SimulatedRig, parse_fault
from needleforce.rig.live.faults import checked_faults
from needleforce.wire.net_ft import RECORD_SIZE, Command, is_fault, pack_request, status_words, unpack_records

N = 2000
REQUEST = pack_request(Command.START, N)


def run(wake=1e-3, request=REQUEST, seed=1, **faults):
    """The datagrams of N records with the times at which they were due, and the ground truth."""
    rig = SimulatedRig(seed, faults=faults)
    rig.request(0.0, request)
    out = []
    for now in np.arange(0.0, 1.1 * N / 1000 + 0.1, wake):
        rig.advance(float(now))
        out += rig.datagrams(float(now))
    return out, rig.transfer.streams[-1]


def sequences(datagrams):
    return [each.sequence for one in datagrams if not one.foreign and len(one.data) == RECORD_SIZE
            for each in unpack_records(one.data)]  # fmt: skip


def sequences_of(datagrams):
    return [record.sequence for one in datagrams for record in unpack_records(one.data)]


def share(count):
    """Bounds of a share of 5 %, four standard errors."""
    return pytest.approx(0.05 * N, abs=4 * np.sqrt(0.05 * 0.95 * N)) == count


def test_without_faults_every_record_arrives_once_in_order_and_in_time():
    out, truth = run()
    assert sequences(out) == list(range(1, N + 1))
    assert truth == type(truth)(sent=N)
    # the first one is the reading after the request
    np.testing.assert_allclose([each.due for each in out], np.arange(1, N + 1) / 1000, atol=1e-9)
    samples = [record.sample for one in out for record in unpack_records(one.data)]
    assert set(np.diff(samples)) == {7} and not any(is_fault(unpack_records(one.data)[0].status) for one in out)


def test_lost_ones_are_those_of_the_ledger():
    out, truth = run(lost=0.05)
    assert share(len(truth.lost))
    assert sequences(out) == [number for number in range(1, N + 1) if number not in truth.lost]


@pytest.mark.parametrize("length", [5, 20])
def test_bursts_have_the_requested_length_and_share(length):
    lost = np.array(
        [
            number
            for seed in range(2)
            for number in (np.array(run(seed=seed, lost=0.1, lost_burst=length)[1].lost) + 2 * N * seed)
        ]
    )
    runs = np.split(lost, np.flatnonzero(np.diff(lost) > 1) + 1)
    whole = [len(each) for each in runs if (each[-1] % (2 * N)) < N]
    assert all(size % length == 0 for size in whole)  # two bursts may touch
    # bursts are drawn: their number scatters by about its root
    assert len(lost) == pytest.approx(0.1 * 2 * N, rel=4 / np.sqrt(0.1 * 2 * N / length))


def test_duplicated_records_arrive_twice():
    out, truth = run(duplicated=0.05)
    received = sequences(out)
    assert share(len(truth.duplicated))
    assert sorted(received) == sorted([*range(1, N + 1), *truth.duplicated])


def test_reordered_records_are_overtaken_by_one_to_three():
    out, truth = run(reordered=0.05)
    received = sequences(out)
    assert share(len(truth.overtaken)) and sorted(received) == list(range(1, N + 1))
    place = {number: k for k, number in enumerate(received)}
    held = set(truth.overtaken)
    for number in held:
        overtaking = [n for n in range(number + 1, min(number + 10, N)) if place[n] < place[number]]
        waiting = [n for n in range(number + 1, number + 4) if n in held]  # delayed themselves
        assert len(overtaking) <= 3
        assert overtaking or waiting or number > N - 4
    assert {b for a, b in pairwise(received) if b < a} <= held


def test_late_records_are_delayed_by_up_to_late_ms():
    out, truth = run(late=0.05, late_ms=50.0)
    due = {unpack_records(one.data)[0].sequence: one.due for one in out}
    delay = np.array([due[number] - number / 1000 for number in range(1, N + 1)])
    assert share(len(truth.late)) and set(np.flatnonzero(delay > 1e-9) + 1) == set(truth.late)
    assert 40e-3 < delay.max() <= 50e-3 and delay[delay > 1e-9].mean() == pytest.approx(25e-3, rel=0.3)


def test_status_errors_are_set_in_the_records():
    out, truth = run(status_error=0.05)
    records = [record for one in out for record in unpack_records(one.data)]
    bad = [record for record in records if is_fault(record.status)]
    assert share(len(bad)) and [record.sequence for record in bad] == truth.status_error
    assert {status_words(record.status) for record in bad} == {"serial link error"}


def test_stale_records_repeat_the_previous_reading():
    out, truth = run(stale=0.05)
    records = [record for one in out for record in unpack_records(one.data)]
    standing = [b.sequence for a, b in pairwise(records) if a.sample == b.sample and a.counts == b.counts]
    assert share(len(truth.stale)) and standing == [number for number in truth.stale if number > 1]


@pytest.mark.parametrize("name", ["foreign", "wrong_size"])
def test_additional_packets_are_counted(name):
    out, truth = run(**{name: 0.05})
    additional = [
        one for one in out if (one.foreign if name == "foreign" else len(one.data) % RECORD_SIZE or not one.data)
    ]
    assert share(getattr(truth, name)) and len(additional) == getattr(truth, name)
    assert sequences(out) == list(range(1, N + 1))


def test_all_faults_together_are_accounted_for():
    names = ("lost", "duplicated", "reordered", "late", "status_error", "stale", "foreign", "wrong_size")
    out, truth = run(lost_burst=3, sensor_drift_ppm=200, **dict.fromkeys(names, 0.05))
    received = sequences(out)
    assert set(received) | set(truth.lost) == set(range(1, N + 1)) and not set(received) & set(truth.lost)
    assert len(received) - len(set(received)) == len(truth.duplicated)


def test_the_share_of_one_fault_does_not_affect_others():
    _, single = run(duplicated=0.05)
    _, both = run(duplicated=0.05, status_error=0.5, late=0.2, foreign=0.5, wrong_size=0.5, stale=0.1)
    assert single.duplicated == both.duplicated


def test_the_polling_interval_does_not_affect_the_stream():
    faults = {"lost": 0.05, "late": 0.05, "reordered": 0.1, "duplicated": 0.05}
    (often, first), (rarely, second) = run(**faults), run(wake=61e-3, **faults)
    assert [one.data for one in often] == [one.data for one in rarely] and first == second


def test_buffered_records_are_sent_in_datagrams_of_forty():
    out, truth = run(request=pack_request(Command.START_BUFFERED, 100), lost=0.0)
    assert [len(unpack_records(one.data)) for one in out] == [40, 40, 20]
    assert truth.sent == 100


def test_records_in_an_incomplete_datagram_are_lost_at_a_stop():
    rig = SimulatedRig()
    rig.request(0.0, pack_request(Command.START_BUFFERED))
    rig.advance(0.1)
    rig.request(0.1, pack_request(Command.STOP))
    assert sequences_of(rig.datagrams(1.0)) == list(range(1, 81))
    assert rig.transfer.streams[0].lost == list(range(81, 101)) and rig.transfer.streams[0].sent == 100


def test_datagrams_on_the_link_are_lost_when_another_stream_begins():
    rig = SimulatedRig(faults={"late": 1.0, "late_ms": 1000.0})
    rig.request(0.0, pack_request(Command.START))
    rig.advance(0.5)
    arrived = [unpack_records(one.data)[0].sequence for one in rig.datagrams(0.5)]
    rig.request(0.5, pack_request(Command.START))
    first = rig.transfer.streams[0]
    assert sorted([*first.lost, *arrived]) == list(range(1, 501)) and first.sent == 500
    rig.advance(2.0)
    assert min(unpack_records(one.data)[0].sequence for one in rig.datagrams(2.0)) == 1


@pytest.mark.parametrize("text", ["lost", "lost=", "lost=x", "lost=0_1", "=", ""])
def test_invalid_texts_of_faults_are_refused(text):
    with pytest.raises(InputError, match="fault"):
        checked_faults(dict([parse_fault(text)]))


@pytest.mark.parametrize("name", FAULTS)
def test_values_outside_the_range_are_refused(name):
    fault = FAULTS[name]
    for value in (fault.low - 1.0, fault.high * 1.01 + 1.0, float("nan")):
        with pytest.raises(InputError, match=f"fault {name}.*outside"):
            checked_faults({name: value})
    assert checked_faults({name: fault.low})[name] == fault.low


def test_an_unknown_fault_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"'gone'.*lost, lost_burst"):
        checked_faults({"gone": 0.1})
    with pytest.raises(InputError, match="integer number"):
        checked_faults({"lost_burst": 2.5})


def test_the_table_of_faults_in_the_documentation_agrees_with_the_program(root):
    page = (root / "docs" / "reference" / "rig.md").read_text(encoding="utf-8")
    for name, fault in FAULTS.items():
        assert f"| `{name}` | {fault.meaning} | {fault.low:g} to {fault.high:g} |" in page
