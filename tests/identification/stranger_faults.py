# SPDX-License-Identifier: Apache-2.0
"""What may be wrong with a stranger's recording: faults, each of which edits the settings of a plain recording, and
named scenarios of them. Seeds draw the settings; ``strangers`` makes recordings of these."""

import numpy as np


def log(rng, low, high):
    """A value from a log-uniform distribution."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def plain(rng):
    """A recording without faults: one cone that punctures, steady stroke, short hold, withdrawal, white noise."""
    return {
        "contact": rng.uniform(-2e-3, 15e-3),
        "free": rng.uniform(1e-3, 8e-3),
        "speed": log(rng, 0.5e-3, 10e-3),
        "acceleration": log(rng, 5e-3, 0.5),
        "depth_below": rng.uniform(4e-3, 18e-3),
        "hold": rng.uniform(0.5, 4.0),
        "legs": None,
        "hand": 0.0,
        "withdraw": 1.0,
        "start_inside": None,
        "rest": rng.uniform(0.05, 0.5),
        "sites": 1,
        "indentation": log(rng, 0.8e-3, 8e-3),
        "puncture_force": log(rng, 0.08, 5.0),
        "law": "cone",
        "n_layers": 1,
        "drop": rng.uniform(0.3, 0.7),
        "cutting_share": rng.uniform(0.15, 0.85),
        "rupture": 0.0,
        "unruptured": False,
        "stretch": log(rng, 20e-6, 0.3e-3),
        "relaxing": (0.0, 1.0),
        "oscillation": (0.0, 1e-3, 0.0),
        "surface": 0.0,
        "texture": (0.0, 0.5e-3, 0),
        "grip": 0.0,
        "outwards": 1.0,
        "speed_power": 0.0,
        "ageing": (0.0, 1.0),
        "gain": 0.0,
        "rate": float(rng.choice([100, 200, 500, 1000, 2000], p=[0.2, 0.15, 0.2, 0.35, 0.1])),
        "noise": log(rng, 0.5e-3, 20e-3),
        "memory": 0.0,
        "hum": 0.0,
        "hum_frequency": 50.0,
        "filter": 1,
        "declared": False,
        "offset": 0.0,
        "drift": 0.0,
        "drift_power": 1,
        "spikes": 0,
        "limit": 0.0,
        "quantum": 0.0,
        "depth_quantum": 0.0,
        "depth_jitter": 0.0,
        "lag": 0.0,
        "clock": 0.0,
        "compliance": 0.0,
        "stuck": 0.0,
        "disorder": 0,
    }


# --- faults: each edits the settings of a recording ------------------------------------------------------------------


def strokes(rng, s, depths, speeds=None):
    """Legs to depths given as shares of the depth below contact."""
    speeds = np.broadcast_to(1.0 if speeds is None else speeds, len(depths))
    s["legs"] = [(s["contact"] + d * s["depth_below"], s["speed"] * v) for d, v in zip(depths, speeds, strict=True)]


def reversals(rng, s):
    """Every few millimetres back by 0.1 to 2 mm."""
    forward = np.sort(rng.uniform(0.1, 0.95, rng.integers(2, 7)))
    back = forward - rng.uniform(0.1e-3, 2e-3, forward.size) / s["depth_below"]
    strokes(rng, s, [*np.column_stack([forward, back]).ravel(), 1.0])


def pull_back(rng, s):
    """One pull-back of 0.1 to 2 mm, before or after the puncture."""
    at = rng.uniform(0.2, 0.9)
    strokes(rng, s, [at, at - log(rng, 0.1e-3, 2e-3) / s["depth_below"], 1.0])


def pauses(rng, s):
    """One to three stops of 0.2 to 3 s on the way."""
    strokes(rng, s, [*np.sort(rng.uniform(0.05, 0.95, rng.integers(1, 4))), 1.0])
    s["legs"] = [leg for goal in s["legs"] for leg in (goal, (None, rng.uniform(0.2, 3.0)))][:-1]


def several_strokes(rng, s):
    """Two to four strokes in one hole, each out of the tissue or part of the way, each deeper or not."""
    goals = []
    for _ in range(rng.integers(2, 5)):
        goals += [rng.uniform(0.6, 1.0), rng.uniform(-0.3, 0.3)]
    strokes(rng, s, goals[:-1])


def layers(rng, s):
    s["n_layers"] = int(rng.integers(2, 4))
    s["depth_below"] = max(s["depth_below"], rng.uniform(1.5, 3.0) * s["n_layers"] * s["indentation"])


def rounded(rng, s):
    s["rupture"] = rng.uniform(0.05e-3, 1.5e-3)


def law_of(name):
    return lambda rng, s: s.update(law=name)


def oscillation(rng, s):
    s["oscillation"] = (rng.uniform(0.2, 0.6), log(rng, 0.2e-3, 2e-3), rng.uniform(0, 6.28))
    s["cutting_share"] = rng.uniform(0.5, 0.9)


def relaxation(rng, s):
    s["relaxing"] = (rng.uniform(0.05, 0.4), log(rng, 0.1, 3.0))
    s["hold"] = max(s["hold"], rng.uniform(1.0, 6.0))


def drift(low, high):
    """Drift over the run as a share of the puncture force."""

    def apply(rng, s):
        s.update(
            drift=rng.choice([-1, 1]) * log(rng, low, high) * s["puncture_force"], drift_power=int(rng.integers(1, 3))
        )

    return apply


def setter(**ranges):
    """A fault that draws each setting: (low, high) uniform, a list one of it, anything else as it is."""

    def apply(rng, s):
        for name, value in ranges.items():
            if isinstance(value, list):
                value = rng.choice(value).item()
            s[name] = rng.uniform(*value) if isinstance(value, tuple) else value

    return apply


def offset(low, high):
    """Force zero in units of the noise, at most 0.3 N."""
    return lambda rng, s: s.update(offset=rng.choice([-1, 1]) * min(log(rng, low, high) * s["noise"], 0.3))


def spikes(rng, s):
    s["spikes"] = int(rng.integers(1, 40))


def average(declared):
    """A running mean over 5 to 100 ms."""
    return lambda rng, s: s.update(filter=max(2, round(log(rng, 5e-3, 0.1) * s["rate"])), declared=declared)


def lag(rng, s):
    s["lag"] = rng.choice([-1, 1]) * rng.uniform(5e-3, 50e-3)


def texture(rng, s):
    s["texture"] = (rng.uniform(0.05, 0.4), log(rng, 0.1e-3, 1e-3), int(rng.integers(1 << 30)))


def grip(rng, s):
    """The surface holds the shaft, so that the force jumps at the exit."""
    s["grip"] = rng.uniform(0.1, 0.6) * max(s["drop"], 0.1) * s["puncture_force"]


def dragged(rng, s):
    """Tissue follows the shaft for millimetres before it slides, and relaxes much, as recorded in skin and muscle."""
    s.update(stretch=rng.uniform(1e-3, 5e-3), relaxing=(rng.uniform(0.2, 0.5), log(rng, 0.2, 2.0)))


def weak(rng, s):
    s.update(drop=rng.uniform(0.05, 0.25), noise=min(s["noise"], s["puncture_force"] / 25))


def short(rng, s):
    """Hardly deeper than the puncture: friction and cutting are all but one."""
    s["depth_below"] = s["indentation"] * rng.uniform(1.05, 1.5)


def unruptured(rng, s):
    s.update(unruptured=True, depth_below=s["indentation"] * rng.uniform(0.4, 0.95))


def no_drop(rng, s):
    """Friction and cutting take over all of the force: nothing falls."""
    s.update(drop=rng.uniform(-0.2, 0.0), rupture=rng.uniform(0.5e-3, 1.5e-3))


def in_contact(rng, s):
    s["free"] = -rng.uniform(0.02, 0.6) * s["indentation"]


def withdrawal_only(rng, s):
    s["start_inside"] = "deepest"


def resting_surface(rng, s):
    s["surface"] = rng.uniform(0.1, 0.8) * s["indentation"]


def noisy_start(rng, s):
    """200 Hz, coarse force, noise of some millinewtons."""
    s.update(rate=200.0, noise=rng.uniform(3e-3, 5e-3), quantum=float(rng.choice([0.0, 10e-3, 20e-3])))


FAULTS = {
    "reversals": reversals,
    "pull_back": pull_back,
    "pauses": pauses,
    "several_strokes": several_strokes,
    "by_hand": setter(hand=(0.3, 1.5)),
    "no_hold": setter(hold=0.0),
    "no_withdrawal": setter(withdraw=0.0),
    "partial_withdrawal": setter(withdraw=(0.2, 0.9)),
    "no_free_travel": setter(free=0.0),
    "in_contact": in_contact,
    "starts_inside": setter(start_inside=(0.05, 0.6)),
    "withdrawal_only": withdrawal_only,
    "two_insertions": setter(sites=2),
    "stuck_depth": setter(stuck=(0.1, 1.0)),
    "compliant_rig": setter(compliance=(0.02e-3, 0.5e-3)),
    "layers": layers,
    "rounded": rounded,
    "cone_cylinder": law_of("cone_cylinder"),
    "power_law": law_of("power_law"),
    "polynomial": law_of("polynomial"),
    "oscillation": oscillation,
    "relaxation": relaxation,
    "resting_surface": resting_surface,
    "texture": texture,
    "grip": grip,
    "dragged": dragged,
    "long_stretch": setter(stretch=(0.3e-3, 1e-3)),
    "weak": weak,
    "short": short,
    "unruptured": unruptured,
    "no_drop": no_drop,
    "offset_small": offset(0.02, 1.0),
    "offset_large": offset(1.0, 60.0),
    "drift_small": drift(0.003, 0.05),
    "drift_large": drift(0.05, 1.0),
    "hum": setter(hum=(1e-3, 20e-3), hum_frequency=[50.0, 60.0]),
    "loud": setter(noise=(20e-3, 50e-3)),
    "coloured": setter(memory=(0.5, 0.98)),
    "quantum": setter(quantum=(1e-3, 20e-3)),
    "depth_quantum": setter(depth_quantum=(1e-6, 50e-6)),
    "depth_jitter": setter(depth_jitter=(0.5e-6, 20e-6)),
    "spikes": spikes,
    "saturation": setter(limit=(0.5, 0.97)),
    "filter": average(False),
    "filter_declared": average(True),
    "lag": lag,
    "clock_jitter": setter(clock=(0.05, 0.45)),
    "slow_rate": setter(rate=(50.0, 100.0)),
    "fast_rate": setter(rate=(2000.0, 10000.0)),
    "disorder": setter(disorder=[1, 3, 20]),
    "noisy_start": noisy_start,
}
# systematic errors that are only in the repeats of a condition, so that the seeds of single recordings stay as they are
SHARED_FAULTS = {
    "outwards": setter(outwards=(0.5, 0.9)),
    "steep_law": lambda rng, s: s.update(law="power_law", exponent=rng.uniform(2.2, 3.0)),
    "speed": lambda rng, s: s.update(speed_power=0.3, acceleration=log(rng, 3e-3, 20e-3)),
    "ageing": lambda rng, s: s.update(ageing=(rng.uniform(0.1, 0.5), log(rng, 1.0, 10.0))),
    "gain": lambda rng, s: s.update(gain=rng.choice([-1, 1]) * rng.uniform(0.02, 0.1)),
}
# what a single stroke cannot have together: the first one drawn stands
EXCLUSIVE = (
    {"reversals", "pull_back", "pauses", "several_strokes", "withdrawal_only"},
    {"no_free_travel", "in_contact", "starts_inside", "withdrawal_only"},
    {"no_withdrawal", "partial_withdrawal", "withdrawal_only"},
    {"cone_cylinder", "power_law", "polynomial"},
    {"unruptured", "weak", "no_drop", "short", "layers"},
    {"unruptured", "rounded", "no_drop"},
    {"unruptured", "starts_inside", "withdrawal_only"},
    {"two_insertions", "withdrawal_only", "starts_inside", "no_withdrawal", "in_contact", "partial_withdrawal"},
    {"offset_small", "offset_large"},
    {"drift_small", "drift_large"},
    {"loud", "noisy_start"},
    {"slow_rate", "fast_rate", "noisy_start"},
    {"filter", "filter_declared"},
    {"relaxation", "no_hold"},
    {"relaxation", "dragged"},
    {"long_stretch", "dragged"},
    {"quantum", "noisy_start"},
)
COMMON = {"offset_small", "offset_large"}
RARE = {
    "disorder",
    "stuck_depth",
    "compliant_rig",
    "withdrawal_only",
    "two_insertions",
    "saturation",
    "no_drop",
    "unruptured",
    "drift_large",
}

SCENARIOS = {
    "plain": (),
    "zero, small": ("offset_small",),
    "zero, large": ("offset_large",),
    "reversals": ("reversals",),
    "one pull-back": ("pull_back",),
    "by hand": ("by_hand",),
    "near contact": ("noisy_start",),
    "spikes": ("spikes",),
    "weak puncture": ("weak",),
    "in contact": ("in_contact", "no_withdrawal", "no_hold"),
    "rounded peak": ("rounded",),
    "power law": ("power_law",),
    "polynomial": ("polynomial",),
    "cone and cylinder": ("cone_cylinder",),
    "no drop": ("no_drop", "relaxation"),
    "no rupture": ("unruptured",),
    "layers": ("layers", "relaxation"),
    "short": ("short",),
    "depth noise": ("depth_jitter", "depth_quantum"),
    "resting surface": ("resting_surface",),
    "lag": ("lag",),
    "filter": ("filter",),
    "filter, declared": ("filter_declared",),
    "oscillation": ("oscillation",),
    "two insertions": ("two_insertions",),
    "withdrawal only": ("withdrawal_only",),
    "starts inside": ("starts_inside",),
    "depth stands": ("stuck_depth",),
    "compliant rig": ("compliant_rig",),
    "saturated sensor": ("saturation",),
    "drift of the peak": ("drift_large",),
    "small drift": ("drift_small",),
    "wrong order": ("disorder",),
    "hum": ("hum",),
    "correlated noise": ("coloured", "loud"),
    "several strokes": ("several_strokes",),
    "pauses": ("pauses", "relaxation"),
    "insertion only": ("no_hold", "no_withdrawal"),
    "partial withdrawal": ("partial_withdrawal", "relaxation"),
    "texture": ("texture",),
    "surface grip": ("grip",),
    "dragged tissue": ("dragged",),
    "as in skin": ("layers", "rounded", "dragged", "grip", "texture"),
    "coarse and slow": ("slow_rate", "quantum", "clock_jitter"),
}

REPEATED = {
    "no error": (),
    "friction differs outwards": ("outwards",),
    "lag": ("lag",),
    "filter": ("filter",),
    "power law": ("power_law",),
    "law above h^2": ("steep_law",),
    "polynomial": ("polynomial",),
    "cone and cylinder": ("cone_cylinder",),
    "surface grip": ("grip",),
    "resting surface": ("resting_surface",),
    "long stretch": ("long_stretch",),
    "coarse force": ("quantum",),
    "small drift": ("drift_small",),
    "friction by speed, slow brake": ("speed",),
    "ageing friction": ("ageing",),
    "drift of the gain": ("gain",),
    "compliant rig": ("compliant_rig",),
}
"""Conditions with one systematic error, which all of their repeats share."""
