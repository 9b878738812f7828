# SPDX-License-Identifier: Apache-2.0
"""The rig without sockets: commands, sites, clocks, stops, and reproducibility from the seed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import needleforce as nf
from needleforce import InputError
from needleforce.rig import paper_experiment
from needleforce.rig.live import SimulatedRig
from needleforce.rig.live.axis import LIMITS, START
from needleforce.wire.axis_lines import MAX_SILENCE_S, move_line, parse_answer
from needleforce.wire.net_ft import Command, pack_request, unpack_records

STREAM = pack_request(Command.START)


def go(rig, begin, end, *lines, active=True):
    """From ``begin`` to ``end`` in steps of 50 ms; the lines are sent at the beginning. Answers, records, states."""
    answers = [parse_answer(rig.command(begin, line)) for line in lines]
    out, states = [], []
    for now in np.arange(begin, end + 1e-9, 50e-3).tolist():
        if active and now > begin:
            rig.command(now, "alive")
        rig.advance(now)
        out += rig.datagrams(now)
        states += rig.states()
    return answers, [record for one in out for record in unpack_records(one.data)], states


def test_the_transmitted_force_is_that_of_the_phantom_at_the_needle():
    rig = SimulatedRig(5)
    rig.request(0.0, STREAM)
    answers, records, _ = go(rig, 0.0, 8.0, move_line(16e-3, 3e-3))
    assert answers[0].accepted
    truth, site = rig.truth(), paper_experiment(5, sites=1, speeds=(3e-3,), depth=6e-3).sites[0]
    np.testing.assert_allclose(truth.force, site.specimen.force(truth.depth - site.surface), atol=1e-9)
    sent = np.array([record.counts for record in records]) / 1e6
    true = truth.force[1 : len(sent) + 1]
    filtered = np.convolve(np.concatenate([np.zeros(9), true]), np.full(10, 0.1), "valid")
    # every axis follows the axial force: crosstalk is a gain; the bias aside, and the drift of 8 s, below 0.3 mN
    fx, fy = site.lateral
    gain = rig.sensor.crosstalk[2] @ [fx, fy, 1.0, -80e-3 * fy, 80e-3 * fx, 0.0]
    assert gain == pytest.approx(1.0, abs=0.02)
    off = sent[:, 2] - gain * filtered
    assert np.std(off) == pytest.approx(np.sqrt(1 + 1 / 12) / 320 / np.sqrt(10), rel=0.1)
    assert truth.refused == 0


def test_seed_and_commands_determine_the_stream():
    def bytes_of(seed):
        rig = SimulatedRig(seed, faults={"lost": 0.1, "late": 0.1})
        rig.request(0.0, STREAM)
        return go(rig, 0.0, 2.0, move_line(0.0, 3e-3))[1:]

    assert bytes_of(3) == bytes_of(3) != bytes_of(4)


def test_a_silent_client_stops_the_needle():
    rig = SimulatedRig()
    go(rig, 0.0, 3.0, move_line(60e-3, 3e-3), active=False)
    truth = rig.truth()
    expected = nf.Motion(START, ((60e-3, 3e-3),)).at(MAX_SILENCE_S)[0] + (3e-3) ** 2 / 2.0
    assert truth.depth[-1] == pytest.approx(expected, abs=1e-8)
    assert rig.axis.condition == "idle"


def test_sites_are_changed_only_outside_at_rest_and_keep_their_holes():
    rig = SimulatedRig()
    refused = [go(rig, 0.0, 0.5, move_line(8e-3, 5e-3), "site 2")[0][1]]
    go(rig, 0.5, 6.0)
    refused.append(go(rig, 6.0, 6.05, "site 2")[0][0])
    assert [(a.accepted, a.reason) for a in refused] == [
        (False, "the axis is moving"),
        (False, "the needle is in the tissue"),
    ]
    go(rig, 6.05, 12.0, move_line(START, 5e-3))
    assert go(rig, 12.0, 12.1, "site 2")[0][0].accepted
    go(rig, 12.1, 22.0, move_line(7.5e-3, 5e-3))
    go(rig, 22.0, 28.0, move_line(START, 5e-3), active=True)
    assert go(rig, 28.0, 28.1, "site 1")[0][0].accepted
    go(rig, 28.1, 36.0, move_line(7.5e-3, 5e-3))
    truth = rig.truth()
    peak = [truth.force[(truth.time > a) & (truth.time < b)].max() for a, b in ((0, 6), (12.1, 22), (28.1, 36))]
    # fresh tissue is punctured at 0.21 N; the old hole has friction and spreading only
    assert peak[0] > 0.19 and peak[1] > 0.19 and peak[0] != peak[1]
    assert peak[2] < 0.75 * peak[0]


@pytest.mark.parametrize("line", ["site 0", "site 70000", "site 99999999999999999999"])
def test_unknown_sites_are_refused(line):
    assert not parse_answer(SimulatedRig().command(0.0, line)).accepted


@pytest.mark.parametrize("line", ["", "jump", "move 1", "move nan 1", "\ufffd\ufffd", "state 1 2 3 4 idle", "x" * 200])
def test_invalid_lines_are_answered_and_change_nothing(line):
    rig = SimulatedRig()
    assert parse_answer(rig.command(0.0, line)).command == "line"
    rig.advance(0.1)
    assert (rig.truth().depth == START).all()


def test_invalid_requests_are_counted():
    rig = SimulatedRig()
    rig.request(0.0, STREAM)
    for data in (b"", b"x" * 7, b"x" * 8, STREAM + b"0", pack_request(Command.STOP)[:7]):
        assert rig.request(0.1, data) is None
    rig.advance(0.2)
    assert rig.truth().garbage == 5 and len(rig.datagrams(0.2)) == 200


@given(st.lists(st.one_of(st.binary(max_size=40), st.text(max_size=250)), max_size=20))
def test_any_input_is_answered_or_counted(inputs):
    rig = SimulatedRig()
    for k, each in enumerate(inputs):
        if isinstance(each, bytes):
            rig.request(1e-3 * k, each)
        else:
            parse_answer(rig.command(1e-3 * k, each))
    assert rig.truth().garbage == sum(isinstance(each, bytes) for each in inputs)


def test_the_stream_is_stopped_and_the_sensor_zeroed_on_request():
    rig = SimulatedRig()
    rig.request(0.0, STREAM)
    rig.advance(0.1)
    assert rig.request(0.1, pack_request(Command.STOP), stops=False) == Command.STOP
    rig.advance(0.2)
    rig.request(0.2, pack_request(Command.BIAS))
    rig.request(0.2, pack_request(Command.STOP))
    rig.advance(0.3)
    assert len(rig.datagrams(0.3)) == 200
    rig.request(0.3, STREAM)
    rig.advance(0.5)
    forces = np.array([unpack_records(one.data)[0].counts for one in rig.datagrams(0.5)]) / 1e6
    assert np.abs(forces[:, :3]).max() < 10e-3  # noise of 1 mN twice; it was tenths of newtons


@pytest.mark.parametrize("ppm", [-5000.0, 0.0, 5000.0])
def test_the_sensor_has_its_own_clock(ppm):
    rig = SimulatedRig(faults={"sensor_drift_ppm": ppm})
    rig.request(0.0, STREAM)
    rig.advance(4.0)
    assert len(rig.datagrams(4.0)) == pytest.approx(4000 * (1 + 1e-6 * ppm), abs=1)


def test_states_have_the_drift_and_offset_of_the_axis_clock():
    rig = SimulatedRig(faults={"axis_drift_ppm": 10_000.0, "clock_offset_s": 50.0})
    rig.advance(5.0)
    states = rig.states()
    assert states[-1].time == pytest.approx(50.0 + 5.0 * 1.01, abs=1 / 60) and len(states) == int(5.0 * 60 * 1.01) + 1


def test_silent_devices_send_nothing_and_the_axis_stops():
    rig = SimulatedRig(faults={"sensor_silent_at_s": 1.0, "axis_silent_at_s": 2.0, "power_cut_s": 4.0})
    rig.request(0.0, STREAM)
    _, records, states = go(rig, 0.0, 3.9, move_line(60e-3, 3e-3))
    assert len(records) == 999 and states[-1].time < 2.0
    assert rig.command(3.9, "stop") is None and rig.request(3.9, STREAM) is None
    # no line was received after 2 s: it stopped by itself
    assert rig.truth().depth[-1] < nf.Motion(START, ((60e-3, 3e-3),)).at(2.0 + MAX_SILENCE_S)[0] + 5e-6
    rig.advance(10.0)
    assert rig.truth().time[-1] == pytest.approx(4.0, abs=1e-3)


def test_a_stalled_axis_reports_it_and_the_force_stays_constant():
    rig = SimulatedRig(faults={"stall_at_s": 3.0})
    _, _, states = go(rig, 0.0, 5.0, move_line(16e-3, 3e-3))
    assert {state.condition for state in states if state.time > 3.0} == {"stalled"}
    assert len({state.depth for state in states if state.time > 3.0}) == 1
    truth = rig.truth()
    assert np.ptp(truth.depth[truth.time > 3.01]) == 0.0
    # after the crack has come to rest the force is constant
    assert np.ptp(truth.force[truth.time > 4.5]) < 1e-12 < truth.force[-1]


def test_any_model_is_tissue():
    rig = SimulatedRig(1, nf.preset("physical"))
    go(rig, 0.0, 5.0, move_line(8e-3, 3e-3))
    truth = rig.truth()
    insertion = nf.Insertion(nf.preset("physical"))
    np.testing.assert_allclose(
        truth.force, [insertion.step(depth, None, 1e-3).force for depth in truth.depth], atol=1e-12
    )
    assert truth.force.max() > 0.0


@pytest.mark.parametrize("seed", [-1, 1.5, "one"])
def test_invalid_seeds_are_refused(seed):
    with pytest.raises(InputError, match="seed"):
        SimulatedRig(seed)


def test_the_greeting_has_the_range_of_the_axis():
    assert parse_answer(SimulatedRig().greeting) == LIMITS
