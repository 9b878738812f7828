# SPDX-License-Identifier: Apache-2.0
"""The report of penetration tests: complete, the same for the same input, and safe with any name."""

import re

import numpy as np
import pytest

from needleforce.bench_tests import penetration_tests

pytest.importorskip("matplotlib")


def penetration_page(tests) -> str:
    return tests._page().html()


def curve(seed, scale=1.0):
    z = np.arange(0.0, 12e-3, 2e-5)
    force = scale * np.interp(1e3 * z, [0, 1, 2, 2.02, 4, 5, 12], [0, 0, 0.8, 0.4, 1.2, 0.3, 0.3])
    return z, force + 4e-3 * np.random.default_rng(seed).standard_normal(len(z))


@pytest.fixture(scope="module")
def tests():
    many = {f"{group}-{k}": curve(k, scale) for group, scale in (("21G", 1.0), ("23G", 0.8)) for k in (1, 2, 3)}
    return penetration_tests(many | {"23G-4": None})


def test_the_page_has_every_section(tests):
    page = penetration_page(tests)
    for title in (
        "Force over travel",
        "Figures by group",
        "Each needle",
        "Further figures by group",
        "What is not given",
        "Definitions and notes",
    ):
        assert f"<h2>{title}</h2>" in page
    assert page.count("<svg") == 6  # three drawings, each wide and narrow
    assert "There is no curve." in page and "7 needles in 2 groups" in page
    assert page == penetration_page(tests)


def test_values_of_the_page_are_those_of_the_tests(tests):
    page = penetration_page(tests)
    for test in tests.tests:
        for name in ("entry_force", "heel_force", "drag", "max_force", "work"):
            assert str(test[name]) in page


def test_text_is_readable_and_nothing_is_loaded(tests):
    page = penetration_page(tests)
    sizes = [float(size) for size in re.findall(r"font-size: ?([0-9.]+)px;? ?[^\"]*\"", page)]
    sizes += [float(size) for size in re.findall(r"font: ?([0-9.]+)px", page)]
    assert min(sizes) >= 7.0
    assert not re.search(r"(src|href)=\"(?!#)", page)


def test_names_are_escaped(tests):
    one = penetration_tests({"<script>alert(1)</script>": tests.tests[0], "b": tests.tests[1]})
    assert "<script>alert" not in penetration_page(one)


def test_one_needle_many_groups_and_none(tests):
    assert "<svg" in penetration_page(penetration_tests([tests.tests[0]]))
    many = {f"{chr(97 + k)}-{n}": tests.tests[k % 6] for k in range(9) for n in (1, 2)}
    assert "mean of all" in penetration_page(penetration_tests(many))
    empty = penetration_page(penetration_tests({"a": None, "b": None}))
    assert "No needle shows a figure" in empty and "<svg" not in empty
