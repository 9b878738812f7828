# SPDX-License-Identifier: Apache-2.0
"""The tissue at a site, step by step: the source paper's phantom or any model."""

import numpy as np

from ...models.model import Insertion, Model
from ...vocabulary import Status
from ..experiment import streams
from ..run import wrench_of
from ..specimen import PRESLIDING, PhantomSite, Scatter, Specimen, draw_site, stick_slip

_NO_LATERAL = {"fx": 0.0, "fy": 0.0, "tx": 0.0, "ty": 0.0}


class ModelTissue:
    """A site in tissue described by ``model``, with its surface at 0 and the memory of its hole; axial force only."""

    surface = 0.0

    def __init__(self, model: Model):
        self._insertion = Insertion(model)
        self.refused = 0  # steps without a force of the model

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis when the tip moves to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
        sample = self._insertion.step(depth, None, dt)
        self.refused += sample.status != Status.ok
        return {"force": sample.force} | _NO_LATERAL


class PhantomTissue:
    """One site of the paper's phantom as in ``Specimen.force``: first pass, second pass, and further passes."""

    def __init__(self, site: PhantomSite):
        self.surface, self._site, self._insertion = site.surface, site, Insertion(site.specimen.model())
        self._second, self._deepest, self._max_step = False, 0.0, 0.0
        self._depth: float | None = None
        self._start = 0.0
        self._sliding = 1.0  # bristle state, +1 for insertion to -1 for withdrawal
        self.refused = 0

    def step(self, depth: float, dt: float) -> dict[str, float]:
        """The wrench [N, N m] by axis when the tip moves to ``depth`` [m] in the rig's zero within ``dt`` [s]."""
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
        self._max_step = max(self._max_step, abs(move))
        self._sliding = min(max(self._sliding + move / PRESLIDING, -1.0), 1.0)
        if depth < 0.0 and move < 0.0 and self._first_ended:
            self._insertion, self._second = self._pierced_before(depth, dt), True

    def _pierced_before(self, depth: float, dt: float) -> Insertion:
        """A second-pass insertion with the hole of this one, moved outside the tissue from its start to ``depth``."""
        insertion = self._site.specimen.pierced(self._deepest, self._start, self._max_step, dt)
        outside = np.linspace(self._start, depth, 2 + int(abs(depth - self._start) / self._max_step))
        insertion.run(outside, None, np.full(len(outside), dt))
        return insertion

    @property
    def _first_ended(self) -> bool:
        """Whether the tissue is pierced and the insertion is still that of the first pass."""
        return self._pierced and not self._second


def phantom_site(seed: int, number: int) -> PhantomSite:
    """Site ``number`` of the phantom of ``seed``, equal to that of ``paper_experiment`` at its first speed."""
    draws = streams(seed, (0, number), 3)[0]
    return draw_site(Specimen(cutting=stick_slip), Scatter(), 0.0, number, draws)
