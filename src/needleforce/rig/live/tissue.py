# SPDX-License-Identifier: Apache-2.0
"""What the needle goes into, step by step: the paper's phantom, site by site, or any model."""

import numpy as np

from ...models.model import Insertion, Model
from ...vocabulary import Status
from ..experiment import streams
from ..paper import stick_slip
from ..run import wrench_of
from ..specimen import PRESLIDING, PhantomSite, Scatter, Specimen, draw_site

_NO_LATERAL = {"fx": 0.0, "fy": 0.0, "tx": 0.0, "ty": 0.0}


class ModelTissue:
    """One place in a tissue of ``model``, surface at 0; it remembers where it has been cut. No force but the axial."""

    surface = 0.0

    def __init__(self, model: Model):
        self._insertion = Insertion(model)
        self.refused = 0  # steps at which the model had no force

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis, the tip having come to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
        sample = self._insertion.step(depth, None, dt)
        self.refused += sample.status != Status.ok
        return {"force": sample.force} | _NO_LATERAL


class PhantomTissue:
    """One site of the paper's phantom as ``Specimen.force`` has it, first pass, second pass and those after it."""

    def __init__(self, site: PhantomSite):
        self.surface, self._site, self._insertion = site.surface, site, Insertion(site.specimen.model())
        self._second, self._deepest, self._fastest = False, 0.0, 0.0
        self._depth: float | None = None
        self._start = 0.0
        self._sliding = 1.0  # of the bristle, +1 in to -1 out
        self.refused = 0

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis, the tip having come to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
        depth -= self.surface
        self._follow(depth, dt)
        sample = self._insertion.step(depth, None, dt)
        self.refused += sample.status != Status.ok
        sliding = self._sliding if self._pierced else 0.0
        more = self._site.specimen.unmodelled_forces(depth, sliding, self._second)
        return wrench_of(self._site, sample.force + float(sum(more.values())))

    @property
    def _pierced(self) -> bool:
        return self._second or self._deepest > self._site.specimen.puncture_depth

    def _follow(self, depth: float, dt: float) -> None:
        if self._depth is None:
            self._depth, self._start = depth, min(depth, 0.0)
        move = depth - self._depth
        self._depth, self._deepest = depth, max(self._deepest, depth)
        self._fastest = max(self._fastest, abs(move))
        self._sliding = min(max(self._sliding + move / PRESLIDING, -1.0), 1.0)
        if depth < 0.0 and move < 0.0 and self._first_ended:
            self._insertion, self._second = self._pierced_before(depth, dt), True

    def _pierced_before(self, depth: float, dt: float) -> Insertion:
        """An insertion that has made the hole from where this one began, and has come to ``depth`` outside again."""
        made = self._site.specimen.pierced(self._deepest, self._start, self._fastest, dt)
        outside = np.linspace(self._start, depth, 2 + int(abs(depth - self._start) / self._fastest))
        made.run(outside, None, np.full(len(outside), dt))
        return made

    @property
    def _first_ended(self) -> bool:
        """Whether the needle, coming out, leaves a hole that its insertion is not yet one of."""
        return self._pierced and not self._second


def phantom_site(seed: int, number: int) -> PhantomSite:
    """Site ``number`` of the phantom of ``seed``: the one that ``paper_experiment`` has at its first speed."""
    draws = streams(seed, (0, number), 3)[0]
    return draw_site(Specimen(cutting=stick_slip), Scatter(), 0.0, number, draws)
