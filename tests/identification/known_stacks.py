# SPDX-License-Identifier: Apache-2.0
"""Random stacks of layers with known values, in the engine's own law: dragged tissue behind a saturating contact."""

from dataclasses import dataclass, replace

import numpy as np

import needleforce as nf
from needleforce import core
from needleforce.models.model import Layer, Model

NOISE = 4e-3  # [N]
SCATTER = 0.2e-3  # [m] of the ruptures between repeats


@dataclass(frozen=True, kw_only=True)
class Stack:
    """Values (layers,) in SI of each layer, and what the layers have in common; depths below the surface."""

    tops: np.ndarray
    indentations: np.ndarray
    coefficients: np.ndarray
    saturations: np.ndarray
    frictions: np.ndarray
    springs: np.ndarray
    lengths: np.ndarray
    surfaces: np.ndarray
    ratio: float
    relaxation: tuple[float, float, float, float]
    motion: nf.Motion

    def model(self, ruptures):
        """The stack that ruptures at depths (layers,) [m]."""
        parts = [self._layer(k, rupture - self.tops[k]) for k, rupture in enumerate(ruptures)]
        deeper = tuple(Layer(top=self.tops[k], **part) for k, part in enumerate(parts) if k)
        return Model(**parts[0], deeper=deeper)

    def _layer(self, k, indentation):
        laws, angle = core.laws, 0.25 * np.pi  # for which c is 2/pi of the modulus
        friction = self.frictions[k], self.springs[k], self.lengths[k], min(self.surfaces[k], indentation), self.ratio
        return {
            "stiffness": laws.ConeCylinder(0.5 * np.pi * self.coefficients[k], angle, 2 * self.saturations[k] / np.pi),
            "puncture": laws.PunctureDepth(indentation),
            "friction": laws.DraggedTissue(*friction),
            "cutting": laws.NoCutting(),
            "relaxation": laws.Prony(*self.relaxation) if self.relaxation else laws.NoRelaxation(),
        }

    def truth(self, ruptures):
        """The named parameters of a fit to repeats that rupture at depths (repeats, layers) [m]."""
        mean = ruptures.mean(axis=0)
        found = {"contact_depth": 0.0, "withdrawal_ratio": self.ratio}
        if self.relaxation:
            names = ("relaxation_share_1", "relaxation_time_1", "relaxation_share_2", "relaxation_time_2")
            found |= dict(zip(names, self.relaxation))
        for k, top in enumerate(self.tops):
            layer = f"layer_{k + 1}_" if k else ""
            found |= {f"{layer}top": top} if k else {}
            own = {
                "stiffness_coefficient": self.coefficients[k],
                "saturation_depth": self.saturations[k],
                "contact_stiffness": 2.0 * self.coefficients[k] * min(self.saturations[k], mean[k] - top),
                "puncture_depth": mean[k],
                "puncture_indentation": mean[k] - top,
                "friction_per_length": self.frictions[k],
                "tissue_stiffness": self.springs[k],
                "rupture_length": self.lengths[k],
                "resting_surface": self.surfaces[k],
            }
            found |= {layer + name: float(value) for name, value in own.items()}
        return found


def wide(seed, layers):
    """A random stack in wider ranges than the search was made with: springs of 100 to 700 N/m, coefficients over a
    decade, ruptures over 0.08 to 1.2 mm, 2 to 8 mm below the top of their layer, holds of 2, 4 or 8 s."""
    random, other = np.random.default_rng([seed, 99]), stack(seed, layers)

    def between(low, high):
        return np.exp(random.uniform(np.log(low), np.log(high), layers))

    indentations = random.uniform(2e-3, 8e-3, layers)
    gaps = indentations[:-1] + random.uniform(-0.8e-3, 3.5e-3, layers - 1)
    tops, springs = np.concatenate([[0.0], np.cumsum(gaps)]), between(100.0, 700.0)
    return replace(
        other,
        tops=tops,
        indentations=indentations,
        springs=springs,
        frictions=np.minimum(between(20.0, 250.0) / np.sqrt(layers), 0.6 * springs / max(other.ratio, 1.0)),
        coefficients=between(8e3, 8e4),
        saturations=between(1.5e-3, 1.2e-2),
        lengths=between(0.08e-3, 1.2e-3),
        surfaces=random.uniform(0.2e-3, 3e-3, layers),
        motion=nf.Motion.insert(
            start=-3e-3,
            speed=float(random.choice([1e-3, 2e-3, 3e-3])),
            depth=tops[-1] + indentations[-1] + random.uniform(2e-3, 6e-3),
            hold=float(random.choice([2.0, 4.0, 8.0])),
        ),
    )


def stack(seed, layers):
    """A random stack in the ranges of skin, muscle and gelatine; a layer may begin above the rupture of the one above
    it, and a rupture may be no drop."""
    random = np.random.default_rng([seed, layers])

    def between(low, high, size=layers):
        return np.exp(random.uniform(np.log(low), np.log(high), size))

    indentations = random.uniform(2.5e-3, 6e-3, layers)
    gaps = indentations[:-1] + random.uniform(-1e-3, 2.5e-3, layers - 1)
    tops = np.concatenate([[0.0], np.cumsum(gaps)])
    springs, ratio = between(150.0, 400.0), float(random.choice([1.0, np.exp(random.uniform(-0.3, 0.5))]))
    frictions = np.minimum(between(40.0, 240.0) / np.sqrt(layers), 0.6 * springs / max(ratio, 1.0))
    shares, times = (
        (random.uniform(0.1, 0.35), random.uniform(0.05, 0.3)),
        (between(0.2, 0.8, None), between(2.0, 5.0, None)),
    )
    relaxes = random.random() < 0.7
    return Stack(
        tops=tops,
        indentations=indentations,
        coefficients=between(1.5e4, 6e4),
        saturations=between(2e-3, 1.1e-2),
        frictions=frictions,
        springs=springs,
        lengths=between(0.1e-3, 0.8e-3),
        surfaces=random.uniform(0.3e-3, 2.5e-3, layers),
        ratio=ratio,
        relaxation=(shares[0], float(times[0]), shares[1], float(times[1])) if relaxes else (),
        motion=nf.Motion.insert(
            start=-3e-3,
            speed=float(random.choice([1e-3, 2e-3, 4e-3])),
            depth=tops[-1] + indentations[-1] + random.uniform(2.5e-3, 5e-3),
            hold=float(random.choice([3.0, 5.0])),
        ),
    )


def repeats(made, seed, count=3):
    """Recordings of a stack at 100 Hz behind white noise and a zero of the sensor, and their ruptures (count, layers)
    [m]."""
    random, found = np.random.default_rng([seed, 77]), []
    ruptures = made.tops + made.indentations + random.normal(0.0, SCATTER, (count, len(made.tops)))
    for own in ruptures:
        run = nf.simulate(made.model(own), made.motion, rate=100.0)
        force = run.force + random.normal(0.0, NOISE, len(run)) + random.uniform(-0.05, 0.05)
        found.append(nf.Recording(time=run.time, depth=run.depth, velocity=run.velocity, force=force))
    return found, ruptures


def judged(fit, truth):
    """The residual over the noise, and the identifiable parameters with whether their interval holds the truth; of a
    fit with another number of layers none is right."""
    residual = float(np.sqrt(np.mean([each.quality.rmse_N**2 for each in fit.recordings]))) / NOISE
    layers = 1 + sum(name.endswith("_top") for name in truth)
    known = {name: each for name, each in fit.parameters.items() if each.identifiable and name in truth}
    right = fit.settings.layers == layers
    return residual, {name: right and each.low <= truth[name] <= each.high for name, each in known.items()}
