# SPDX-License-Identifier: Apache-2.0
"""Saved bytes carry the layout of their members: after one is added, moved or renamed, older bytes are refused."""

import hashlib
import re

import pytest
from building import said
from elftools.elf.elffile import ELFFile

# a new thing with `save` has its line here
SAVED = """
#include "needleforce/bending/flexible_insertion.hpp"
#include "needleforce/events/event_detector.hpp"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/solid/condensed_insertion.hpp"
template <class Engine> using Kept = decltype(std::declval<Engine>().save().state());
template <class Engine> using Bent = decltype(std::declval<Engine>().save().bending.state());
Kept<needleforce::Insertion>* insertion;
Bent<needleforce::bending::PlanarInsertion>* planar;
Bent<needleforce::bending::SpatialInsertion>* spatial;
Kept<needleforce::solid::CondensedInsertion>* solid;
Kept<needleforce::events::EventDetector>* events;
Kept<needleforce::online::OnlineIdentifier>* online;
"""
SAVING = "condensed_insertion event_detector flexible_insertion insertion online_identifier".split()
AGGREGATES = {"DW_TAG_structure_type", "DW_TAG_class_type", "DW_TAG_union_type"}
OTHER_NAMES = {"DW_TAG_typedef", "DW_TAG_const_type", "DW_TAG_volatile_type"}


def name(die) -> str:
    found = die.attributes.get("DW_AT_name")
    return found.value.decode() if found else ""


def number(die, attribute, otherwise=0) -> int:
    found = die.attributes.get(attribute)
    return found.value if found else otherwise


def kind(die):
    """The type of a variable, of a member, or what a pointer points to."""
    found = die.get_DIE_from_attribute("DW_AT_type")
    while found.tag in OTHER_NAMES:
        found = found.get_DIE_from_attribute("DW_AT_type")
    return found


def layout(die, at=0, path=""):
    """A line for each number, flag, word and array: where, how large, which kind, and its name."""
    size = number(die, "DW_AT_byte_size")
    if die.tag == "DW_TAG_base_type":
        yield f"{at} {size} {number(die, 'DW_AT_encoding')} {path}"
    elif die.tag == "DW_TAG_enumeration_type":
        yield f"{at} {size} {','.join(map(name, die.iter_children()))} {path}"
    elif die.tag == "DW_TAG_array_type":
        counts = [number(each, "DW_AT_upper_bound") + 1 for each in die.iter_children()]
        yield f"{at} {counts} of {number(kind(die), 'DW_AT_byte_size')} {path}"
        yield from layout(kind(die), at, path)
    else:
        assert die.tag in AGGREGATES, f"{path}: a saved state has no {die.tag}"
        yield from members(die, at, path)


def members(die, at, path):
    for child in die.iter_children():
        if child.tag in {"DW_TAG_member", "DW_TAG_inheritance"} and "DW_AT_external" not in child.attributes:
            own = name(child) and not name(child).startswith("_M")  # the library of C++ may rename its members
            place = at + number(child, "DW_AT_data_member_location")
            yield from layout(kind(child), place, f"{path}.{name(child)}" if own else path)
        elif child.tag == "DW_TAG_GNU_template_parameter_pack":  # the memories that share their bytes
            for i, each in enumerate(child.iter_children()):
                yield from layout(kind(each), at, f"{path}<{i}>")


def layouts(text, folder, *flags):
    """Of what each pointer of a text of C++ points to, its name and the lines of its layout."""
    (folder / "saved.cpp").write_text(text, encoding="utf-8")
    said(["g++", "-std=c++20", "-c", "-g", *flags, folder / "saved.cpp", "-o", folder / "saved.o"])
    with (folder / "saved.o").open("rb") as file:
        for unit in ELFFile(file).get_dwarf_info().iter_CUs():
            for die in unit.get_top_DIE().iter_children():
                typed = die.tag == "DW_TAG_variable" and "DW_AT_type" in die.attributes
                if typed and kind(die).tag == "DW_TAG_pointer_type":
                    yield name(die), list(layout(kind(kind(die))))


def digest(named) -> str:
    text = "\n".join(line for name, lines in sorted(named) for line in (name, *lines))
    return "0x" + hashlib.sha256(text.encode()).hexdigest()[:16]


def test_the_number_of_the_layout_is_that_of_the_members(root, tmp_path):
    headers = (root / "include").rglob("*.hpp")
    assert sorted(path.stem for path in headers if " save() const" in path.read_text(encoding="utf-8")) == SAVING
    named = list(layouts(SAVED, tmp_path, f"-I{root / 'include'}"))
    assert len(named) == SAVED.count("* ") and all(len(lines) > 20 for _, lines in named)
    header = (root / "include" / "needleforce" / "state_bytes.hpp").read_text(encoding="utf-8")
    stated = re.search(r"state_layout = (0x[0-9a-f]{16})u", header)[1]
    assert stated == digest(named), "what is saved has another layout: put the second number into state_bytes.hpp"


MEMBERS = "struct Part { double c; bool d; }; template <class... M> struct One { char bytes[8]; };"
BEFORE = "double a, b; Part part; One<Part, double> one;"


@pytest.mark.parametrize(
    "after",
    [
        "double b, a; Part part; One<Part, double> one;",
        "double a, new_name; Part part; One<Part, double> one;",
        "double a; long b; Part part; One<Part, double> one;",
        "double a, b; Part part; One<double, Part> one;",
        "double a, b; Part part; One<Part, double> one; enum { x, y } in_the_padding;",
    ],
)
def test_a_member_that_is_moved_renamed_or_of_another_type_changes_the_number(after, tmp_path):
    numbers = [digest(layouts(f"{MEMBERS} struct S {{ {text} }}* s;", tmp_path)) for text in (BEFORE, BEFORE, after)]
    assert numbers[0] == numbers[1] != numbers[2]
