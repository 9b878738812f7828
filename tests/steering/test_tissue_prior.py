# SPDX-License-Identifier: Apache-2.0
"""A prior over tissues: what it learns from others, and what it leaves to the data of the next one."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from unseen_tissues import STIFFNESS, Tissue

import needleforce as nf
from needleforce.steering import TissuePrior, identify, prior
from needleforce.steering.tissue_prior import Spread

NEEDLE = nf.Needle(1.27e-3, 0.0, 0.6, STIFFNESS * 64.0 / (math.pi * 1.27e-3**4))


def known(names, mean, sd, form="linear"):
    """A fit that knows its parameters with independent errors."""
    found = Spread(np.array(mean, float), np.diag(np.square(sd)))
    parameters = [SimpleNamespace(name=name) for name in names]
    predictor = SimpleNamespace(parameters=parameters, insertions=(1,), found=found, response_found=Spread.wide(4))
    return SimpleNamespace(form=form, predictor=predictor)


def test_a_prior_is_the_mixture_of_what_tissues_show_and_of_the_wide_one():
    learnt = prior([known(["modulus"], [2.0], [0.5]), known(["modulus"], [4.0], [0.5])])
    assert learnt.tissues == 2
    assert learnt.spread.mean == pytest.approx([2.0])  # of 0, 2 and 4
    assert learnt.spread.covariance[0, 0] == pytest.approx((1.0 + 0.25 + 0.25) / 3.0 + (4.0 + 0.0 + 4.0) / 3.0)
    np.testing.assert_allclose(learnt.response.covariance, np.eye(4))


def test_a_prior_has_no_direction():
    learnt = prior([known(["axis_x", "modulus", "axis_y"], [3.0, 1.0, 0.0], [0.1, 0.1, 0.1])])
    assert learnt.spread.mean == pytest.approx([0.0, 0.5, 0.0])
    variances = np.diag(learnt.spread.covariance)
    assert variances[0] == variances[2] and learnt.spread.covariance[0, 1] == 0.0
    # of 3 and 0 along x and twice 0 along y, about no direction
    assert variances[0] == pytest.approx(0.5 * (1.0 + 0.01) + 0.5 * (9.0 / 2.0))


def test_what_is_far_outside_is_given_room():
    spread = Spread(np.zeros(2), np.diag([0.04, 1.0]))
    learnt = TissuePrior("linear", ("modulus", "surface"), spread, Spread.wide(4), 3)
    near, far, open_ = (Spread(np.array([place, 0.1]), np.diag([error**2, 1.0]))
                        for place, error in ((0.3, 0.15), (5.0, 0.15), (5.0, 2.5)))  # fmt: skip
    np.testing.assert_allclose(learnt.widened(near).spread.covariance, spread.covariance)
    assert not learnt.contradicted(near) and not learnt.contradicted(open_)
    # 5 with errors of 0.2 and 0.15, 0.25 together, is 20 standard deviations away, which become two of the prior
    assert learnt.contradicted(far) == {"modulus": pytest.approx(20.0)}
    np.testing.assert_allclose(learnt.widened(far).spread.covariance, np.diag([0.04 * 10.0**2, 1.0]))


def test_fits_of_several_forms_have_no_prior():
    with pytest.raises(nf.InputError, match="same model"):
        prior([])
    with pytest.raises(nf.InputError, match="linear with 1 parameters and yielding with 1"):
        prior([known(["modulus"], [0.0], [1.0]), known(["modulus"], [0.0], [1.0], "yielding")])


def lateral(predicted, path):
    return np.sqrt(np.mean(np.sum((predicted - path.tip)[:, :2] ** 2, axis=1)))


@pytest.fixture(scope="module")
def fits():
    """Fits of two insertions with the wide priors, with one that is far off, and with one of another tissue; and what
    is held out."""
    paths = Tissue("softening", 3).paths((False, False, True, True, True))
    wide = identify([paths[0], paths[2]], NEEDLE, model="linear")
    names = tuple(each.name for each in wide.model.predictor.parameters)
    mean, sd = np.zeros(len(names)), np.ones(len(names))
    k = names.index("modulus")
    mean[k], sd[k] = wide.model.predictor.found.mean[k] + 3.0, 0.1  # ninety times as stiff, within 15 %
    wrong = TissuePrior("linear", names, Spread(mean, np.diag(sd**2)), Spread.wide(4), 5)
    other = identify(Tissue("softening", 4).paths((False, False, True, True)), NEEDLE, model="linear")
    learnt = prior([other])
    given = {name: identify([paths[0], paths[2]], NEEDLE, model="linear", prior=each)
             for name, each in (("wrong", wrong), ("learnt", learnt))}  # fmt: skip
    return {"wide": wide, **given}, paths[3:]


def inside(fit, path):
    half = 1.96 * np.hypot(fit.uncertainty(path), 0.2e-3)
    return np.mean(np.abs(fit.predict(path) - path.tip)[:, :2] < half[:, None])


def test_data_that_contradict_a_prior_widen_it(fits):
    found, held = fits
    wrong, wide = found["wrong"], found["wide"]
    assert list(wrong.contradicted) == ["modulus"] and not found["learnt"].contradicted
    assert any("contradict the prior" in remark and "modulus by" in remark for remark in wrong.remarks())
    for path in held:
        assert lateral(wrong.predict(path), path) < 1.1 * lateral(wide.predict(path), path)
        assert inside(wrong, path) >= inside(wide, path)


def test_a_learnt_prior_is_kept_in_a_file(fits, tmp_path):
    found, held = fits
    fit = found["learnt"]
    fit.save(tmp_path / "gel.toml")
    again = nf.steering.load(tmp_path / "gel.toml")
    np.testing.assert_array_equal(again.predictor.tip(held[0]), fit.predict(held[0]))
    np.testing.assert_array_equal(again.predictor.uncertainty(held[0]), fit.uncertainty(held[0]))
    text = (tmp_path / "gel.toml").read_text(encoding="utf-8")
    for written, bad, words in (
        ("tissues = 1", "tissues = 0", "tissues of a prior"),
        ("\nmean = [", "\nmean = [0.0, ", "mean of a prior"),
        ("response_covariance = [[", "response_covariance = [[-", "covariance"),
    ):
        (tmp_path / "bad.toml").write_text(text.replace(written, bad), encoding="utf-8")
        with pytest.raises(nf.InputError, match=words):
            nf.steering.load(tmp_path / "bad.toml")
    with pytest.raises(nf.InputError, match="12 parameters of the linear model"):
        identify(held, NEEDLE, prior=again.predictor.prior)
