# SPDX-License-Identifier: Apache-2.0
"""The schema of protocol files: keys carry their unit, unknown keys are refused."""

from typing import Annotated, Literal

from msgspec import Meta, Struct

Text = Annotated[str, Meta(min_length=1, max_length=1000, pattern=r"^[^\x00-\x1f\x7f-\x9f]*$")]  # it is printed
Length = Annotated[float, Meta(gt=0, le=1000)]  # [mm]
Speed = Annotated[float, Meta(ge=1e-3, le=1000)]  # [mm/s]
Time = Annotated[float, Meta(ge=0, le=86400)]  # [s]
Number = Annotated[int, Meta(ge=1, le=9999)]
Sites = Number | Annotated[tuple[Number, ...], Meta(min_length=1, max_length=9999)]


class NeedleSection(Struct, forbid_unknown_fields=True):
    """The needle; ``tip`` in words."""

    diameter_mm: Length
    length_mm: Length
    tip: Text


class TissueSection(Struct, forbid_unknown_fields=True):
    """The tissue, in words."""

    text: Text


class AxisSection(Struct, forbid_unknown_fields=True):
    """Where insertions begin, as a depth: below 0 above the surface; what the axis can do, if it is to be said."""

    start_mm: Annotated[float, Meta(lt=0, ge=-1000)]
    deepest_mm: Length | None = None
    max_speed_mm_s: Speed | None = None


class SensorSection(Struct, forbid_unknown_fields=True, frozen=True):
    """The sensor: the axis that opposes insertion, samples in its average filter, time at rest for the bias."""

    axial: Literal["fz", "-fz"] = "fz"
    filter_length: Annotated[int, Meta(ge=1, le=1_000_000)] = 1
    bias_s: Annotated[float, Meta(gt=0, le=60)] = 0.5


class SeriesSection(Struct, forbid_unknown_fields=True):
    """Insertions at one speed; ``sites`` is how many of each depth, numbered on from those before, or their numbers."""

    speed_mm_s: Speed
    sites: Sites
    depths_mm: Annotated[tuple[Length, ...], Meta(min_length=1, max_length=100)]
    hold_s: Time = 0.0
    passes: Annotated[int, Meta(ge=1, le=99)] = 1
    second_pass_short_mm: Annotated[float, Meta(ge=0, le=1000)] = 0.0
    pause_s: Time = 0.0


class ProtocolFile(Struct, forbid_unknown_fields=True):
    """A protocol file."""

    title: Text
    reference: Text
    needle: NeedleSection
    tissue: TissueSection
    axis: AxisSection
    force_limit_N: Annotated[float, Meta(gt=0, le=1000)]
    series: Annotated[tuple[SeriesSection, ...], Meta(min_length=1, max_length=100)]
    sensor: SensorSection = SensorSection()
    spare_sites: Annotated[int, Meta(ge=0, le=999)] | tuple[Number, ...] = 0
    rig: str = ""
    name_prefix: Annotated[str, Meta(max_length=60)] = ""
