# SPDX-License-Identifier: Apache-2.0
"""The README's first screen: a recording in, a model out, its force in a loop, and both curves."""

import needleforce as nf

recording = nf.read("examples/insertion.csv")  # recognises columns and units, or asks for them
fit = nf.identify(recording, needle="paper")  # the needle of a preset, or a file such as needle.toml
for estimate in fit.parameters.values():
    print(estimate)
insertion = nf.Insertion(fit.model)  # the identified model, one cycle of a control loop at a time
print(f"force at a depth of 1 mm: {insertion.step(1e-3, 3e-3, 1e-3).force:.4f} N")
fit.plot().figure.savefig("first.svg")
print("wrote first.svg")
