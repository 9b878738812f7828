# SPDX-License-Identifier: Apache-2.0
"""The README's first screen: a recording in, a model out, and its force along the recording."""

import matplotlib.pyplot as plt

import needleforce as nf

recording = nf.read("examples/insertion.csv")  # recognises columns and units, or asks for them
fit = nf.identify(recording, needle=nf.preset("paper").needle)
for estimate in fit.parameters.values():
    print(f"{estimate.name:24s} {estimate.value:.4g} ({estimate.low:.4g} to {estimate.high:.4g}) {estimate.unit}")
insertion = nf.Insertion(fit.model)  # the identified model, one 1 kHz cycle at a time
print(f"force at a depth of 1 mm: {insertion.step(1e-3, 3e-3, 1e-3).force:.4f} N")
plt.plot(1e3 * recording.depth, recording.force, label="recorded")
plt.plot(1e3 * recording.depth, fit.predict(recording), label="identified")
plt.gca().set(xlabel="depth [mm]", ylabel="force [N]"), plt.legend()
plt.savefig("first.svg")
