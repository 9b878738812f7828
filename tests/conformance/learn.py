# SPDX-License-Identifier: Apache-2.0
"""The same streams through the Python package."""

import sys
from pathlib import Path

from needleforce import core
from needleforce.online.prior import NAMES, Prior, core_identifier


def prior_of(numbers: list[float]) -> Prior:
    punctures, same, radius, angle, spacing, *rest = numbers
    pairs = list(zip(rest[0:24:2], rest[1:24:2], strict=True))
    layers = tuple(dict(zip(NAMES, pairs[6 * k : 6 * k + 6], strict=True)) for k in range(2))
    return Prior(
        layers=layers,
        same_tissue=bool(same),
        complete=bool(punctures),
        tip=core.tips.Cone(angle),
        radius=radius,
        earlier=list(zip(rest[24:185], rest[185:], strict=True)),
        spacing=spacing,
    )


def row(online, event) -> list:
    numbers = [online.innovation, *online.surface[:2]]
    for k in range(2):
        layer = online.layer(k)
        numbers += [each for name in NAMES[:3] for each in layer[name][:2]]
        numbers += [layer["puncture_depth"], layer["puncture_force"]]
    ahead = online.ahead(2e-3)
    numbers += [ahead[name][i] for i in (0, 5, 10) for name in ("force", "low", "high")]
    numbers += [ahead["puncture_probability"], ahead["puncture"][0], online.pierced]
    return [*numbers, event.kind if event else "none", online.regime, online.status]


for path in sys.argv[1:]:
    print("case", path)
    online, samples = core_identifier(Prior()), 0
    for line in Path(path).read_text(encoding="utf-8").splitlines():
        match line.split():
            case ["prior", *numbers]:
                online = core_identifier(prior_of(list(map(float, numbers))))
            case ["keep"]:
                kept = online.save()
            case ["restore"]:
                online.restore(kept)
                print("taken")
            case ["reset"]:
                online.reset()
            case sample:
                event = online.step(*map(float, sample))
                samples += 1
                if samples % 20 == 0 or event is not None:
                    print(*row(online, event))
