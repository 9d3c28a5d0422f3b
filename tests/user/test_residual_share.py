"""Strength that may lie below the residual strength is spoken of before anything is computed."""

import dataclasses
import warnings

import pytest
import scipy.stats

import stiction as st
from stiction.random.stresses import check_residual, share_below_residual


def test_strength_below_the_residual_strength_is_said_before_computing(solid, make_strength):
    """The marginal reaches down to 0.66 MPa; 4.7 % of it lie below 0.73 MPa, 60 % below 1 MPa."""

    def problem(residual):
        friction = st.LinearWeakening(weakening_rate=0.5e12, residual_strength=residual)
        return st.Problem(solid, st.Interface(length=0.1, nodes=256), friction)

    strength = make_strength(0.5)
    share = 100.0 * strength.marginal.distribution.cdf(0.73e6)
    text = rf"{share:.3g} % of its marginal, which reaches from 660000 to 1\.66e\+06 Pa"
    for compute in (
        lambda p: st.monte_carlo(p, strength, method=st.LocalCriterion(), samples=2),
        lambda p: st.failure_probability(
            p, strength, stress=0.7e6, method=st.LocalCriterion(), max_evaluations=100
        ),
        lambda p: st.design_stress(p, strength, probability=0.01, method=st.LocalCriterion()),
    ):
        with pytest.raises(st.InputError, match="most of the interface would not weaken"):
            compute(problem(1.0e6))
    with pytest.warns(st.AccuracyWarning, match=text):
        check_residual(problem(0.73e6), st.RandomInterface(strength=strength))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_residual(problem(0.66e6), st.RandomInterface(strength=strength))
        residual = st.RandomField(
            marginal=st.Beta(alpha=2, beta=2, low=0.0, high=0.66e6), spectrum=strength.spectrum
        )
        check_residual(
            problem(0.0), st.RandomInterface(strength=strength, residual_strength=residual)
        )


@pytest.mark.parametrize("strengths", [(1.0, 1.0), (2e6, 1.0), (1.0, 2e6), (2e6, 2e6)])
def test_strengths_in_coefficients_are_compared_as_stresses(problem, make_strength, strengths):
    """Both overlap in a quarter of each, in Pa (unit 1) or as coefficients (unit 2 MPa): 1/32."""
    pressed = dataclasses.replace(problem, load=st.Load(normal_pressure=2e6))
    fields = [
        st.RandomField(
            scipy.stats.uniform(low / unit, 4e5 / unit),
            make_strength().spectrum,
            of=None if unit == 1.0 else "friction_coefficient",
        )
        for low, unit in zip((3e5, 0.0), strengths, strict=True)
    ]
    random = st.RandomInterface(strength=fields[0], residual_strength=fields[1])
    assert share_below_residual(pressed, random) == pytest.approx(1.0 / 32.0, rel=1e-5)
