"""A slider on a base, as users describe it: what is refused, studies, and figures."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from recording import refusals
from setups import EXACT, LOCAL, beta_strength  # noqa: F401  # slider.json calls them
from sliders import SOLID, coefficients, rig_problem

import stiction as st

PROBLEM = rig_problem()
MU = coefficients(PROBLEM)
STIFF = dataclasses.replace(SOLID, shear_modulus=80e9, density=7800.0)


def sampled(mu=MU, **parts):
    return rig_problem(**parts).sample(mu)


def coefficient(value):
    return xr.DataArray(value, attrs={"units": "1"})


test_what_a_slider_does_not_take = refusals("slider", globals())


def test_coefficients_times_the_mean_pressure():
    """Residual coefficients come as a ratio, a number or a profile."""
    sample = PROBLEM.sample({"strength": MU})
    pressure = 4e3 / (0.14 * 0.006)
    assert sample.strength[0] == pytest.approx(MU.values * pressure, rel=1e-12)
    plain = rig_problem(problem={"friction": st.LinearWeakening(weakening_rate=1e11)})
    for residual in (coefficient(0.45), coefficients(plain, 0.45, amplitude=0.0)):
        rows = plain.sample({"strength": MU, "residual_strength": residual})
        assert rows.residual_strength[0] == pytest.approx(0.45 * pressure, rel=1e-12)
    assert PROBLEM.nucleation_length == pytest.approx(2.0 * 0.57888694 * 0.5 * 3e9 / 1e11)


def test_a_critical_slip_belongs_to_the_local_pressure():
    """W = (mu_p - mu_r) N_0/d_c: a tilted press weakens its heavy end most steeply."""
    friction = st.LinearWeakening(critical_slip=5e-5, residual_ratio=0.6)
    rates = [
        rig_problem(tilt=tilt, problem={"friction": friction}).sample(MU).weakening_rate[0]
        for tilt in (-0.5, 0.0, 0.5)
    ]
    assert rates[0][:16].mean() > rates[1][:16].mean() > rates[2][:16].mean()
    assert rates[1].mean() == pytest.approx(0.28 * 4e3 / (0.14 * 0.006) / 5e-5, rel=0.05)


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_figure_at_the_first_instability(side):
    """Shear is at most the peak strength, and the trailing end has slipped most."""
    drive = st.Pusher(height=0.02, width=0.01, side=side)
    problem = rig_problem(nodes=96, drive=drive)
    rig, stresses, slip = st.plot.specimen(problem, coefficients(problem))
    shear, pressure, peak = (line.get_ydata() for line in stresses.lines)
    moved = slip.lines[0].get_ydata()
    assert rig.get_aspect() == 1.0  # to scale
    assert np.all(shear <= peak + 1e-9)
    np.testing.assert_allclose(peak, coefficients(problem) * pressure)
    assert moved[0 if side == "left" else -1] == moved.max() > 0.0


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("stiffness", [0.0, 6e7])
def test_a_slider_that_hardly_weakens_is_a_slider_that_never_weakens(stiffness):
    """However close its residual strength is: its load was 1e15 Pa at the edge of round-off."""
    drive = dataclasses.replace(PROBLEM.specimen.drive, stiffness=stiffness)
    onsets = []
    for drop in (0.0, *10.0 ** np.arange(-13.0, -8.5, 0.5)):
        law = st.LinearWeakening(critical_slip=9e-6, residual_ratio=1.0 - max(drop, 1e-15))
        problem = rig_problem(problem={"friction": law}, drive=drive)
        onsets.append(st.onset(problem, MU, method=EXACT))
    never = onsets[0]
    for onset in onsets:
        for name in ("critical_stress", "first_instability"):
            np.testing.assert_allclose(onset[name], never[name], rtol=1e-8)
        assert onset.critical_load < 1.5 * never.critical_load
