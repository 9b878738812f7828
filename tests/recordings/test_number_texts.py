# SPDX-License-Identifier: Apache-2.0
"""Signs of thousands, decimal signs and exponents in tables of text; expected values by hand."""

import numpy as np
import pytest
from plain_insertion import insertion

from needleforce.errors import InputError
from needleforce.recording import read

TIME, DEPTH, FORCE = insertion(rate=50.0)


@pytest.mark.parametrize("decimal, group", [(".", ","), (",", ".")])
def test_signs_of_thousands(file, decimal, group):
    def cell(value):
        return f"{value:,.4f}".replace(",", "_").replace(".", decimal).replace("_", group)

    rows = [";".join(map(cell, row)) for row in zip(TIME, 1e6 * DEPTH, 1e3 * FORCE)]
    run = read(file("Zeit (s);Weg (µm);Kraft (mN)\n" + "\n".join(rows)))
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-10)
    np.testing.assert_allclose(run.force, FORCE, atol=1e-7)


@pytest.mark.parametrize(
    ("sign", "group"), [(".", ","), (",", "."), (".", "'"), (".", "\u2019"), (",", "\u00a0"), (",", "\u202f")]
)
def test_signs_of_thousands_that_begin_late(file, sign, group):
    """More rows than the first ones are below 1000, and one column has no decimal sign."""

    def cell(value, digits):
        return f"{value:,.{digits}f}".translate({ord(","): group, ord("."): sign})

    time = np.arange(0.0, 12.0, 0.01)
    depth, force = np.round(2e3 * time), 0.7 * np.clip(2e3 * time - 2e3, 0.0, None)
    rows = [f"{cell(t, 2)};{cell(z, 0)};{cell(f, 3)}" for t, z, f in zip(time, depth, force)]
    run = read(file("Zeit (s);Weg (µm);Kraft (mN)\n" + "\n".join(rows) + "\n"))
    np.testing.assert_allclose(run.depth, 1e-6 * depth, atol=1e-12)
    np.testing.assert_allclose(run.force, 1e-3 * force, atol=1e-6)


def test_columns_with_different_decimal_signs(file):
    rows = [f"{t:.2f}".replace(".", ",") + f";{1e3 * z:.4f};{f:.5f}" for t, z, f in zip(TIME, DEPTH, FORCE)]
    run = read(file("Time (s);Depth (mm);Force (N)\n" + "\n".join(rows) + "\n"))
    np.testing.assert_allclose(run.time, TIME, atol=1e-9)
    np.testing.assert_allclose(run.depth, DEPTH, atol=1e-7)
    np.testing.assert_allclose(run.force, FORCE, atol=1e-5)


def test_a_column_with_two_decimal_signs_names_the_line(file):
    rows = [f"{t:.2f};{1e3 * z:.4f};{f:.5f}".replace(".", ",") for t, z, f in zip(TIME, DEPTH, FORCE)]
    rows[300] = rows[300][::-1].replace(",", ".", 1)[::-1]
    with pytest.raises(InputError, match=r"line 302: force .*decimal sign of the other rows"):
        read(file("Time (s);Depth (mm);Force (N)\n" + "\n".join(rows) + "\n"))


def test_exponents_of_fortran(file):
    rows = [" ".join(f"{value:.9E}".replace("E", "D") for value in row) for row in zip(TIME, DEPTH, FORCE)]
    run = read(file("time_s depth_m force_N\n" + "\n".join(rows) + "\n"))
    np.testing.assert_allclose(run.force, FORCE, rtol=1e-8, atol=1e-12)


def test_blanks_as_signs_of_thousands_are_named(file):
    rows = [f"{t:.2f}\t{1e3 * z:.2f}\t1 {abs(f):03.0f}" for t, z, f in zip(TIME, DEPTH, FORCE)]
    with pytest.raises(InputError, match=r"line 2: force .*without signs of thousands"):
        read(file("Time [s]\tDepth [mm]\tForce [mN]\n" + "\n".join(rows) + "\n"))


def test_a_sign_in_every_number_that_other_columns_do_not_have_is_not_guessed(file):
    rows = [f"{t:.2f};{1e3 * z:.2f};1,{round(1e3 * f) % 1000:03d}" for t, z, f in zip(TIME, DEPTH, np.abs(FORCE))]
    with pytest.raises(InputError, match=r"force .*is ambiguous"):
        read(file("Time [s];Depth [mm];Force [N]\n" + "\n".join(rows) + "\n"))


def test_numbers_with_narrow_blanks_in_one_byte(tmp_path):
    time = np.arange(0.0, 12.0, 0.01)
    rows = [f"{t:.2f};{2.0 * t:.2f};" + f"{150.0 * t:,.1f}".replace(",", "\u00a0") for t in time]
    text = "Time (s);Depth (mm);Force (mN)\n" + "\n".join(rows) + "\n"
    (tmp_path / "run.csv").write_bytes(text.encode("cp1252"))
    np.testing.assert_allclose(read(tmp_path / "run.csv", baseline=False).force, 0.15 * time, atol=1e-4)
