# SPDX-License-Identifier: Apache-2.0
"""Constructed fits, so that a report can be checked against the values in this file."""

import math

import numpy as np
import pytest

import needleforce as nf
from needleforce.identification.estimates import Estimate, Quality
from needleforce.identification.layered.identify import LayeredFit
from needleforce.identification.layered.prediction import Ruptures
from needleforce.identification.recording_fit import RecordingFit
from needleforce.identification.result import Fit
from needleforce.identification.settings import Choice, Evidence, FitSettings, LayeredSettings
from needleforce.identification.two_pass.result import Site, TwoPass
from needleforce.recording.recording import Card, Note, Recording
from needleforce.segmentation.events import Event, Events, Puncture, Span
from needleforce.vocabulary import Phase, Status

CONTACT, PUNCTURE = 2e-3, 5.237e-3  # m, in the recording's own zero
NOISE = 5e-3  # N


def events_of(recording: Recording) -> Events:
    """The events of the preset ``paper`` run to 22 mm and back, found by depth."""
    depth, time = recording.depth, recording.time
    deepest = int(np.argmax(depth))
    contact, puncture = (int(np.searchsorted(depth[:deepest], at)) for at in (CONTACT, PUNCTURE))
    exit_ = deepest + int(np.argmax(depth[deepest:] < CONTACT))
    edges = [0, contact, puncture, deepest, exit_, len(time)]
    phases = (Phase.free, Phase.deformation, Phase.insertion, Phase.extraction, Phase.free)
    limits = zip(phases, edges[:-1], edges[1:], strict=True)
    spans = (Span(phase, time[a], time[min(b, len(time) - 1)], a, b) for phase, a, b in limits)
    at = {k: (time[k], depth[k], recording.force[k], k - 1, k) for k in (contact, puncture, exit_)}
    ruptured = Puncture(*at[puncture], drop=0.072, indentation=PUNCTURE - CONTACT)
    return Events(Event(*at[contact]), (ruptured,), Event(*at[exit_]), tuple(spans))


def recording_fit(number: int, rate=100.0, name="site_{}.csv", factor=1.0, notes=()) -> RecordingFit:
    """One noisy run of the preset ``paper`` with its model; ``factor`` other than 1 makes it anomalous."""
    motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=20e-3, hold=0.0, withdraw=True)
    run = nf.simulate(nf.preset("paper"), motion, rate=rate)
    force = factor * run.force + NOISE * np.random.default_rng(number).standard_normal(len(run))
    card = Card(source="virtual", sha256="ab" * 32, needle="0.7 mm", filter_length=10, assumptions=("time in s",))
    found = tuple(Note("gap", message) for message in notes)
    recording = Recording(run.time, run.depth + CONTACT, run.velocity, force, {}, card, found)
    rms = float(np.std(force - run.force))
    quality = Quality(rms, rms / 0.37, 0.99)
    own = {"puncture_force": Estimate("puncture_force", 0.21, "N", 0.20, 0.22)}
    return RecordingFit(
        file=f"runs/{name.format(number)}", status=Status.ok, recording=recording, events=events_of(recording),
        parameters=own, quality=quality, predicted=run.force,
    )  # fmt: skip


def site(number: int) -> Site:
    """Both passes at one site with a cutting force of 0.0776 N."""
    grid, noise = np.linspace(3.2e-3, 11.2e-3, 400), 1e-3 * np.random.default_rng(number).standard_normal((2, 400))
    second = 18.6 * grid + noise[0]
    first = second + 0.0776 + noise[1]
    inside = grid < 10e-3
    return Site(
        grid=grid, first=first, second=second, difference=first - second, oscillating=first - second, noise=1e-3,
        friction_depth=grid[inside], friction_force=second[inside], friction_slope=18.6, friction_slope_half=0.1,
        friction_intercept=0.0, friction_end=10e-3, friction_end_reason="the needle bends", cutting=0.0776,
        cutting_half=1e-3,
    )  # fmt: skip


@pytest.fixture
def make_fit():
    """Builds a Fit of ``count`` repeats; keywords go to ``recording_fit``, ``two_pass`` adds sites."""

    def make(count: int = 1, two_pass: bool = False, anomalous: int | None = None, **options) -> Fit:
        runs = [recording_fit(k, factor=1.5 if k == anomalous else 1.0, **options) for k in range(1, count + 1)]
        estimates = (
            Estimate(
                "puncture_indentation",
                3.2370e-3,
                "m",
                3.1981e-3,
                3.2759e-3,
                between_repeats_sd=1.3e-4,
                source="complete fit",
            ),
            Estimate("puncture_force", 0.21014, "N", 0.2057, 0.2145, between_repeats_sd=0.0105, source="complete fit"),
            Estimate("stiffness_coefficient", 20051.3, "N/m^2", 19430.0, 20672.6, source="complete fit"),
            Estimate("friction_per_length", 18.6, "N/m", 18.45, 18.75, source="second pass"),
            Estimate(
                "reduced_modulus",
                117546.0,
                "Pa",
                110000.0,
                129000.0,
                identifiable=False,
                source="with a half angle of 15°",
            ),
        )
        return Fit(
            recordings=tuple(runs), parameters={each.name: each for each in estimates},
            identified_model=nf.preset("paper"),
            quality=Quality(0.0053, 0.0147, 0.991), warnings=("lateral forces are not small",),
            held_fixed=("tip half angle: 15°",),
            unknown=("The friction coefficient.",), choice=(Choice("cone", -100.0), Choice("cone_cylinder", -130.0)),
            settings=FitSettings(
                stiffness_law="cone", needle=None, repeats=count, answering=count, lateral_over_axial_force=0.012,
                noise="white",
            ), two_pass=TwoPass(sites=tuple(map(site, range(count)))) if two_pass else None,
        )  # fmt: skip

    return make


@pytest.fixture
def empty_fit():
    """Nothing identified: one recording without contact, one that could not be read."""
    silent = recording_fit(1)
    silent = RecordingFit(
        file="silent.csv", status=Status.no_contact, recording=silent.recording,
        events=Events(status=Status.no_contact),
    )  # fmt: skip
    broken = RecordingFit(
        file="broken.csv", status=Status.unreadable, recording=None, events=Events(status=Status.unreadable),
        notes=("no column",),
    )  # fmt: skip
    return Fit(recordings=(silent, broken))


LAYER_PUNCTURES = (10e-3, 17e-3)  # m, in the zero of the recordings: 8 mm, and 5 mm below a top at 10 mm
EVIDENCE = [
    Evidence(choice="1 layer", parameters=12, residual=0.055, bic=-100.0, left_out=0.068, ties=False, chosen=False),
    Evidence(choice="2 layers", parameters=22, residual=0.014, bic=-964.0, left_out=0.037, ties=False, chosen=True),
    Evidence(
        choice="2 layers, no saturation", parameters=20, residual=0.015, bic=-953.0, left_out=0.039, ties=True,
        chosen=False,
    ),
]  # fmt: skip


def layered_run(number: int) -> RecordingFit:
    """One run of the preset ``layered`` with its surface at 2 mm and the force of the complete model."""
    motion = nf.Motion.insert(start=-5e-3, speed=3e-3, depth=20e-3, hold=2.0)
    run = nf.simulate(nf.preset("layered"), motion, rate=100.0)
    force = run.force + NOISE * np.random.default_rng(number).standard_normal(len(run))
    recording = Recording(run.time, run.depth + CONTACT, run.velocity, force, {}, Card(source=f"run_{number}"), ())
    reached = (True, number != 2)
    own = {
        name: Estimate(
            name, depth, "m", depth - 1e-4, depth + 1e-4 if reached_it else math.inf, identifiable=reached_it
        )
        for name, depth, reached_it in zip(("puncture_depth", "layer_2_puncture_depth"), LAYER_PUNCTURES, reached)
    }
    quality = Quality(NOISE, NOISE / 1.7, 0.999)
    return RecordingFit(
        file=f"run_{number}.csv", status=Status.ok, recording=recording, events=events_of(recording), parameters=own,
        quality=quality, predicted=run.force,
    )  # fmt: skip


@pytest.fixture
def layered_fit():
    """Two runs of the preset ``layered``, with its own parameters as the identified ones."""
    sizes = {
        "contact_depth": (CONTACT, 1e-4, "m"), "puncture_depth": (10e-3, 2e-4, "m"),
        "friction_per_length": (140.0, 5.0, "N/m"), "layer_2_top": (10e-3, 1e-3, "m"),
        "layer_2_puncture_depth": (17e-3, 3e-4, "m"), "layer_2_friction_per_length": (70.0, 6.0, "N/m"),
        "relaxation_share_1": (0.31, 0.02, "1"),
    }  # fmt: skip
    found = {
        name: Estimate(
            name,
            value,
            unit,
            value - half,
            value + half,
            between_repeats_sd=half / 2,
            source="layered fit",
            within_run_sd=half / 4,
        )
        for name, (value, half, unit) in sizes.items()
    }
    ruptures = Ruptures(np.array(LAYER_PUNCTURES), np.zeros(2), CONTACT)
    model = nf.preset("layered")
    settings = LayeredSettings(
        stiffness_law="cone_cylinder", needle=None, repeats=2, answering=2, lateral_over_axial_force=None,
        noise="white", parameters=22, speed_m_s=3e-3, layers=2, chosen_by="repeats left out", evidence=tuple(EVIDENCE),
    )  # fmt: skip
    runs = (layered_run(1), layered_run(2))
    return LayeredFit(
        recordings=runs, parameters=found, identified_model=model, quality=Quality(NOISE, 0.003, 0.999),
        choice=(Choice("2 layers", -964.0), Choice("1 layer", -100.0)), settings=settings,
        ruptures=ruptures, population=model, population_contact=CONTACT,
    )  # fmt: skip
