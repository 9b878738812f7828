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
    "steady_curvature": "mechanics.beam_on_foundation",
    "switch_on_path": "mechanics.beam_on_foundation",
    "reduced_modulus": "core",
    "tips": "core",
    "laws": "core",
    "steering": "steering",
    "fe": "fe",
    "Needle": "core",
    "Tissue": "core",
    "Sample": "core",
    "Layer": "models.model",
    "Model": "models.model",
    "Insertion": "models.model",
    "InsertionBatch": "models.insertion_batch",
    "FlexibleInsertion": "models.flexible_insertion",
    "LateralLayer": "core",
    "EventDetector": "core",
    "events": "events",
    "OnlineIdentifier": "online",
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
    "study": "studies.study",
    "Phase": "vocabulary",
    "Status": "vocabulary",
    "InputError": "errors",
    "__version__": "vocabulary",
}
_MOVED = ("switch_on_path",)  # still found here, and in its own module
__all__ = sorted(name for name in _HOME if not name.startswith("_") and name not in _MOVED)


def __getattr__(name: str):
    """Loads a name when it is first used, so that importing needleforce costs no more than the core."""
    if name not in _HOME:
        raise AttributeError(f"module 'needleforce' has no attribute {name!r}")
    module = import_module(f".{_HOME[name]}", __name__)
    value = module if _HOME[name] == name else getattr(module, name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
