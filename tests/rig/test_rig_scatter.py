# SPDX-License-Identifier: Apache-2.0
"""The paper's scatter between sites, tested with many sites."""

import numpy as np
import pytest

from needleforce import InputError
from needleforce.rig import Scatter, Specimen
from needleforce.rig.specimen import draw_site

SITES = 4000


@pytest.fixture(scope="module")
def sites():
    random = np.random.Generator(np.random.PCG64(11))
    return [draw_site(Specimen(), Scatter(), 3e-3, number, random) for number in range(SITES)]


def simulated_peak(specimen):
    """The force of the compiled law at the puncture, which is the peak of the loading."""
    return specimen.model().stiffness.force(specimen.puncture_depth)


def close(values, mean, sd):
    """Mean and standard deviation within four standard errors."""
    assert np.mean(values) == pytest.approx(mean, abs=4.0 * sd / np.sqrt(SITES))
    assert np.std(values, ddof=1) == pytest.approx(sd, rel=4.0 / np.sqrt(2.0 * SITES))


def test_peaks_depths_and_cutting_scatter_as_in_the_paper(sites):
    close([simulated_peak(site.specimen) for site in sites], 0.2101, 0.0105)
    close([site.specimen.puncture_depth for site in sites], 3.237e-3, 0.1347e-3)
    close([site.specimen.cutting_force for site in sites], 0.0776, 0.0139)


def test_peak_and_depth_are_drawn_independently(sites):
    pairs = np.array([(site.specimen.puncture_force, site.specimen.puncture_depth) for site in sites])
    assert abs(np.corrcoef(pairs.T)[0, 1]) < 4.0 / np.sqrt(SITES)


def test_independent_modulus_and_depth_would_give_too_much_scatter_of_the_peak(sites):
    """The same moduli and depths paired at random, which the rig avoids."""
    depths = [site.specimen.puncture_depth for site in sites]
    laws = [site.specimen.model().stiffness for site in sites]
    shuffled = np.random.Generator(np.random.PCG64(0)).permutation(depths)
    assert np.std([law.force(depth) for law, depth in zip(laws, shuffled)]) > 1.5 * 0.0105


def test_lateral_forces_are_two_to_five_percent(sites):
    share = np.hypot(*np.array([site.lateral for site in sites]).T)
    assert share.min() >= 0.02 and share.max() <= 0.05


def test_scatter_below_zero_is_refused():
    with pytest.raises(InputError, match=r"scatter\.surface"):
        Scatter(surface=-1e-3)
