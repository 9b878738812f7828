# SPDX-License-Identifier: Apache-2.0
"""Every source names a work that is in the bibliography, and every work there is named somewhere."""

import pytest
from law_places import unnamed_parts

import needleforce as nf
from needleforce import core
from needleforce.bench_tests.laws import SOURCES
from needleforce.models.laws import FAMILIES, laws_of
from needleforce.models.named_models import NAMED_MODELS
from needleforce.references import keys_in, published_values, works


def tables():
    tips = [tip for tip in vars(core.tips).values() if hasattr(tip, "table")]
    return [core.Needle, core.Tissue, *tips, *(law for family in FAMILIES for law in laws_of(family))]


def sources():
    for owner in tables():
        yield from (row["source"] for row in owner.table())
        if hasattr(owner, "source"):
            yield owner.source
    yield from (named.source for named in NAMED_MODELS.values())
    yield from SOURCES.values()


def test_every_part_of_a_source_names_a_known_work():
    assert {source: unnamed_parts(source) for source in sources() if unnamed_parts(source)} == {}


@pytest.mark.parametrize(
    "source, keys",
    [
        ("eq. (6); Sneddon 1965", ("source paper", "Sneddon 1965")),
        ("Fung 1993, sec. 7.6, quasi-linear", ("Fung 1993",)),
        (
            "Simone & Okamura 2002; Okamura, Simone & O'Leary 2004",
            ("Simone & Okamura 2002", "Okamura, Simone & O'Leary 2004"),
        ),
        ("by definition", ()),
        ("nobody 1999", ()),
    ],
)
def test_keys_are_read_from_a_source(source, keys):
    assert keys_in(source) == keys


def test_a_part_without_a_work_is_found():
    assert unnamed_parts("Sneddon 1965; nobody 1999; free: chosen") == ["nobody 1999"]


@pytest.mark.parametrize("name", nf.presets())
def test_the_reference_of_a_preset_names_a_known_work(name):
    assert keys_in(nf.preset(name).reference)


def test_published_values_name_a_known_work_each():
    assert {value.source for value in published_values()} <= set(works())


def test_no_work_stands_there_unused():
    presets = [nf.preset(name).reference for name in nf.presets()]
    laws = [law.validity for family in FAMILIES for law in laws_of(family)]
    used = {key for source in [*sources(), *presets, *laws] for key in keys_in(source)}
    used |= {value.source for value in published_values()}
    # the foundation is no law: its two works are named where its formulas are
    assert set(works()) - used <= {"Vesic 1961", "Biot 1937"}


@pytest.mark.parametrize("name", ["docs/explanation/mechanics.md", "CITATION.cff", "citations"])
def test_what_the_text_of_the_source_paper_does_not_state_is_not_cited(root, name):
    cited = next(text for text in nf.preset("paper").citations if "PVA phantom" in text)
    text = " ".join((cited if name == "citations" else (root / name).read_text(encoding="utf-8")).split())
    (sentence,) = (part for part in text.split(". ") if "as far as" in part.lower() or "text as available" in part)
    missing = ("title", "authors", "journal", "year", "DOI")
    assert all(word in sentence for word in missing) and "state" in sentence
