# SPDX-License-Identifier: Apache-2.0
"""needleforce: the force of a needle in soft tissue, from mechanics to force and from recordings to mechanics.

SI units throughout; force is positive when it opposes insertion, depth is positive inwards.
"""

from importlib import import_module

_HOME = {
    "contact": "mechanics.contact",
    "foundation_modulus": "mechanics.foundation",
    "friction_per_length": "mechanics.foundation",
    "friction_coefficient": "mechanics.foundation",
    "cycle_work": "mechanics.energy",
    "buckling_force": "mechanics.buckling",
    "reduced_modulus": "core",
    "tips": "core",
    "laws": "core",
    "Needle": "core",
    "Tissue": "core",
    "Sample": "core",
    "Layer": "models.model",
    "Model": "models.model",
    "Insertion": "models.model",
    "preset": "preset_files",
    "presets": "preset_files",
    "Motion": "models.simulation",
    "simulate": "models.simulation",
    "Recording": "recording",
    "read": "recording",
    "read_all": "recording",
    "write": "recording",
    "segment": "segmentation",
    "identify": "identification",
    "compare": "identification",
    "Fit": "identification",
    "Phase": "vocabulary",
    "Status": "vocabulary",
    "InputError": "errors",
    "__version__": "vocabulary",
}
__all__ = sorted(name for name in _HOME if not name.startswith("_"))


def __getattr__(name: str):
    """Loads a name when it is first used, so that importing needleforce costs no more than the core."""
    if name not in _HOME:
        raise AttributeError(f"module 'needleforce' has no attribute {name!r}")
    value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
