# SPDX-License-Identifier: Apache-2.0
"""What a user may write, for type checkers: read, identify, and the force in a loop."""

import needleforce as nf


def largest_force(path: str) -> float:
    """The largest force [N] of the identified model over the depths of a recording."""
    recording = nf.read(path)
    fit = nf.identify(recording, needle=nf.preset("paper").needle)
    print({name: (estimate.value, estimate.low, estimate.high) for name, estimate in fit.parameters.items()})
    insertion = nf.Insertion(fit.model)
    return max(insertion.step(float(depth), 3e-3, 1e-3).force for depth in recording.depth)


print(f"{largest_force('examples/insertion.csv'):.3f} N")
