"""Friction laws against their own definitions, and polygons along a law."""

import numpy as np
import pytest
from setups import examples

import stiction as st
from stiction.problem.friction import FrictionLaw
from stiction.problem.friction.kernels import line_at, strength_at, strengths

DROP, RESIDUAL, RATE = 1.1e6, 0.3e6, 0.4e12
LAWS = examples("laws of one weakening rate")


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_kernels_follow_the_law(law):
    critical = law.critical_slip_of(DROP, RATE)
    u = np.array([0.0, 0.1, 0.25, 0.5, 0.7, 0.9, 2.0])
    nodes = [value * np.ones(u.size) for value in (RESIDUAL + DROP, RESIDUAL, RATE)]
    found = strengths(law.parameters, *nodes, u * critical)
    np.testing.assert_allclose(found, RESIDUAL + DROP * law.fraction(u), rtol=1e-14)
    arguments = law.parameters, RESIDUAL + DROP, RESIDUAL, RATE

    def slope_at(slip):
        return line_at(*arguments, slip, 0.0)[1]

    for slip in u * critical:
        # No corner lies in the interval of the difference, which is exact on straight pieces.
        step = 1e-4 * critical
        fall = strength_at(*arguments, slip) - strength_at(*arguments, slip + step)
        assert fall == pytest.approx(slope_at(slip + 0.5 * step) * step, rel=1e-6, abs=1e-6)
        start, steep = line_at(*arguments, 0.1 * critical, slip - 0.1 * critical)
        assert steep == pytest.approx(slope_at(slip), rel=1e-12)
        reached = start - steep * (slip - 0.1 * critical)
        assert reached == pytest.approx(strength_at(*arguments, slip), rel=1e-14)
    # W is the rate at which the strength first falls, just after a plateau.
    assert slope_at(1.0001 * law.plateau * critical) == pytest.approx(RATE, rel=1e-14)
    assert law.plateau == 0.0 or slope_at(0.9999 * law.plateau * critical) == 0.0


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_integral_and_inverse_of_a_law_follow_from_f(law):
    """A law that states neither has those of its f: pieces are cubic, so a kink costs 1e-7."""
    u, close = np.array([0.0, 0.1, 0.37, 0.95, 1.0, 3.0, np.inf]), 1e-6
    close = 1e-10 if law.type == "exponential" else close
    np.testing.assert_allclose(FrictionLaw.area(law, u), law.area(u), close, 1e-3 * close)
    for fraction in (0.95, 0.37, 0.01):
        assert FrictionLaw.slip_at(law, fraction) == pytest.approx(
            law.slip_at(fraction), rel=1e-12
        )
    assert FrictionLaw.slip_at(law, 0.0) == pytest.approx(law.slip_at(0.0), rel=1e-9) or (
        law.type == "exponential" and FrictionLaw.slip_at(law, 0.0) > 700.0
    )


def test_polygon_along_a_law():
    law = st.ExponentialWeakening(critical_slip=2e-6, residual_ratio=0.2)
    polygon = st.PiecewiseWeakening.from_law(law, 8)
    u = polygon.critical_slip / 2e-6 * np.array(polygon.slip)[:-1]
    # Corners on the law, at equal losses; the last piece dissipates what the tail does.
    np.testing.assert_allclose(polygon.strength, 1.0 - np.arange(1, 9) / 8, atol=1e-15)
    np.testing.assert_allclose(law.fraction(u), polygon.strength[:-1], rtol=1e-14)
    tail = polygon.integral * polygon.critical_slip / 2e-6
    corners = np.append(0.0, u)
    assert tail - np.trapezoid(law.fraction(corners), corners) == pytest.approx(1 / 8)
    assert polygon.residual_ratio == 0.2
    # A polygon along a polygon of few corners keeps to it.
    again = st.PiecewiseWeakening.from_law(LAWS["dual"], 5)
    np.testing.assert_allclose(again.slip[2], 0.2, rtol=1e-14)
    assert again.weakening_rate == pytest.approx(RATE, rel=1e-14)


@pytest.mark.parametrize("scale", ["weakening_rate", "critical_slip", "fracture_energy"])
def test_a_polygon_has_the_scale_of_its_law(scale):
    law = st.ExponentialWeakening(weakening_rate=RATE)
    critical = law.critical_slip_of(DROP, RATE)
    energy = DROP * critical * law.integral
    value = {"weakening_rate": RATE, "critical_slip": critical, "fracture_energy": energy}[
        scale
    ]
    polygon = st.PiecewiseWeakening.from_law(st.ExponentialWeakening(**{scale: value}), 8)
    # Of the chord to the first corner, at seven eighths of the drop.
    chord = DROP / 8.0 / (critical * law.slip_at(0.875))
    assert polygon.weakening_rate_of(np.array([DROP]), *polygon.scale)[0] == pytest.approx(
        chord, rel=1e-12
    )
