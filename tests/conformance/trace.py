# SPDX-License-Identifier: Apache-2.0
"""The conformance set through the Python package; README.md says what a case is."""

import sys
from math import ldexp
from pathlib import Path

import numpy as np

import needleforce as nf
from needleforce import fe
from needleforce.models.laws import FAMILIES, law_called

PARTS = ("depth", "velocity", "force", "stiffness", "friction", "cutting", "lateral", "force_by_depth")
PARTS += ("force_by_velocity", "phase", "status")
TIPS = {tip.name: tip for tip in vars(nf.tips).values() if hasattr(tip, "name")}


def numbers(words: list[str]) -> dict:
    pairs = zip(words[::2], words[1::2])
    return {name: value if name in ("equivalence", "form") else float(value) for name, value in pairs}


def velocity_of(word: str) -> float | None:
    return None if word == "-" else float(word)


def solid(spacing: str, nodes: str, scale: str, fall: str) -> fe.CondensedTissue:
    apart = np.subtract.outer(np.arange(int(nodes)), np.arange(int(nodes))).astype(float)
    return fe.CondensedTissue(float(spacing), float(scale) / (1.0 + float(fall) * (apart * apart)))


class Case:
    """A case as it is read: `lines` is what it has written so far. Another host has its own `engine`."""

    def __init__(self):
        self.lines = []
        self.layers, self.settings, self.ticks, self.insertion, self.made = [], {}, 0, None, False
        self.tissue, self.lateral, self.sections, self.bending, self.base_ticks = None, [], [], {}, [0] * 5

    def write(self, *words):
        self.lines.append(" ".join(map(str, words)))

    def describe(self, what: str, words: list[str]) -> bool:
        """True for a line of the model."""
        if what == "layer":
            self.layers.append({"top": float(words[0])})
        elif what == "set":
            self.settings[words[0]] = float(words[1])
        elif what in FAMILIES:
            self.layers[-1][what] = words
        elif what in ("tip", "knot"):
            self.layers[-1].setdefault(what, []).append(words)
        elif what == "solid":
            self.tissue = solid(*words)
        elif what == "lateral":
            self.lateral.append(words)
        elif what == "section":
            self.sections.append(tuple(map(float, words)))
        elif what == "bending":
            self.bending[words[0]] = float(words[1])
        else:
            return False
        return True

    def law(self, layer: dict, family: str):
        name, *words = layer.get(family, ["no_relaxation"])
        given = numbers(words)
        if "tip" in layer and family == "stiffness":
            (tip, *words) = layer["tip"][0]
            knots = [[float(word) for word in knot] for knot in layer.get("knot", [])]
            given["tip"] = TIPS[tip](*map(list, zip(*knots))) if knots else TIPS[tip](**numbers(words))
        return law_called(family, name)(**given)

    def make(self):
        self.made = True
        bevel = {name.removeprefix("bevel_"): v for name, v in self.settings.items() if name.startswith("bevel_")}
        limits = {name: v for name, v in self.settings.items() if not name.startswith("bevel_")}
        try:
            stack = [nf.Layer(layer["top"], *(self.law(layer, family) for family in FAMILIES)) for layer in self.layers]
            first, deeper = dict(zip(FAMILIES, stack[0].parts)), tuple(stack[1:])
            model = nf.Model(**first, deeper=deeper)
            self.insertion = self.engine(model, limits, nf.core.Bevel(**bevel))
        except nf.InputError:
            self.write("refused")

    def engine(self, model, limits: dict, bevel):
        if not self.lateral and self.tissue is not None:
            return fe.CondensedInsertion(self.tissue, model, **limits, bevel=bevel)
        if not self.lateral:
            return nf.Insertion(model, **limits, bevel=bevel)
        lateral = [nf.LateralLayer(top=float(top), **numbers(words)) for top, *words in self.lateral]
        lengths = {name: int(value) if name == "elements" else value for name, value in self.bending.items()}
        needle = nf.Needle(1e-3, 0.0, lengths.pop("needle_length", float("nan")), 1e11, 0.3)
        lengths |= {"tissue": self.tissue, "bevel": bevel, **limits}
        return nf.FlexibleInsertion(model, needle, lateral=lateral, sections=self.sections, **lengths)

    def move(self, what: str, words: list[str]):
        if not self.made:
            self.make()
        if self.insertion is not None:
            getattr(self, what)(*words)

    def at(self, ticks):
        self.ticks = int(ticks)

    def go(self, n, dt, velocity, *travels):
        for i in range(int(n)):
            self.ticks += int(travels[i % len(travels)])
            self.advance(ldexp(self.ticks, -30), velocity_of(velocity), float(dt))

    def step(self, depth, velocity, dt):
        self.advance(float(depth), velocity_of(velocity), float(dt))

    def carry(self, n, dt, depth, *across):
        for _ in range(int(n)):
            self.ticks += int(depth)
            self.base_ticks = [ticks + int(travel) for ticks, travel in zip(self.base_ticks, across)]
            self.bend(*(ldexp(ticks, -30) for ticks in (self.ticks, *self.base_ticks)), float(dt))

    def base(self, *words):
        self.bend(*map(float, words))

    def bend(self, depth, x, y, tilt_x, tilt_y, roll, dt):
        sample = self.insertion.step(depth, (x, y), tilt=(tilt_x, tilt_y), roll=roll, dt=dt)
        self.print(sample.axial)
        vectors = [*sample.tip, *sample.tangent, *sample.wrench]
        scalars = [sample.force, sample.lateral, sample.unsupported_length, sample.status, int(sample.buckled)]
        self.write("bent", *map(float, vectors), *scalars)

    def shape(self):
        for point in self.insertion.shape():
            self.write("point", *map(float, point))

    def nodes(self):
        self.write("tip", self.insertion.tip)
        for force, displacement in zip(self.insertion.node_force, self.insertion.displacement):
            self.write("node", float(force), float(displacement))

    def reset(self):
        self.insertion.reset()

    def keep(self):
        self.kept = self.insertion.save()

    def restore(self):
        self.take(self.kept)

    def alter(self, where):
        altered = bytearray(self.kept)
        altered[int(where)] ^= 1
        self.take(bytes(altered))

    def take(self, memory: bytes):
        try:
            self.insertion.restore(memory)
            self.write("taken")
        except nf.InputError:
            self.write("refused")

    def advance(self, depth, velocity, dt):
        self.print(self.insertion.step(depth, velocity, dt))

    def print(self, sample):
        events = (sample.contact, sample.punctured, sample.exit)
        self.write(*(getattr(sample, part) for part in PARTS), *(int(event) for event in events))


def traced(path: Path, kind: type[Case] = Case) -> Case:
    """A case after its motion."""
    case = kind()
    for line in path.read_text(encoding="utf-8").splitlines():
        what, *words = line.split() or ["#"]
        if not what.startswith("#") and not case.describe(what, words):
            case.move(what, words)
    return case


if __name__ == "__main__":
    for path in sys.argv[1:]:
        print("\n".join([f"case {path}", *traced(Path(path)).lines]))
