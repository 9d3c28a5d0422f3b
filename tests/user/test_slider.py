"""A slider on a base, as users describe it: what is refused, studies, and figures."""

import dataclasses

import numpy as np
import pytest
import xarray as xr
from refusals import refuses, warning_texts
from setups import EXACT, LOCAL, beta_strength
from sliders import SOLID, coefficients, rig_problem

import stiction as st

PROBLEM = rig_problem()
MU = coefficients(PROBLEM)
STIFF = dataclasses.replace(SOLID, shear_modulus=80e9, density=7800.0)


def sampled(mu=MU, **parts):
    return lambda: rig_problem(**parts).sample(mu)


def coefficient(value):
    return xr.DataArray(value, attrs={"units": "1"})


REFUSED = {
    "a push above the slider": (
        "drive ... 0.075 to 0.085 ... largest height 0.07 m fits",
        sampled(drive=st.Pusher(height=0.08, width=0.01)),
    ),
    "a push wider than the slider": (
        "drive ... largest width 0.01 m fits",
        sampled(drive=st.Pusher(height=0.07, width=0.02)),
    ),
    "two pushers": (
        "drive.side ... 'left' or 'right'",
        sampled(drive=st.Pusher(height=0.02, width=0.01, side="both")),
    ),
    "a mass": ("drive.mass", sampled(drive=st.Pusher(height=0.02, width=0.01, mass=1.0))),
    "a platen": ("drive ... Pusher", sampled(drive=st.Platen())),
    "a machine without thickness": (
        "thickness ... drive.stiffness",
        sampled(thickness=None, drive=st.TopShear(stiffness=1e7)),
    ),
    "a plate that tilts": ("tilt ... plate", sampled(pressing="plate", tilt=0.1)),
    "a press that pulls": ("tilt", sampled(tilt=1.2)),
    "a base that ends first": (
        "behind ... -0.01",
        lambda: st.Base(height=0.03, behind=-0.01),
    ),
    "sizes in mm": (
        "specimen.height: 75 m ... specimen.base.behind: 60 m ... Check its unit (m)",
        sampled(height=75.0, base=st.Base(height=0.03, behind=60.0)),
    ),
    "a coarse mesh for the pusher": (
        "specimen.drive.width ... interface.nodes = 20 or more",
        sampled(nodes=16, drive=st.Pusher(height=0.02, width=0.007)),
    ),
    "a coarse mesh for the nucleation length": (
        "interface.nodes: must be 130 or more",
        sampled(problem={"friction": st.LinearWeakening(weakening_rate=4e11, residual_ratio=0.6)}),
    ),
    "a coarse mesh for the base": (
        "specimen.base.height ... nodes = 70 or more",
        sampled(base=st.Base(height=0.004)),
    ),
    "toppling": (
        "topples ... at most 0.667 times ... 0.8",
        sampled(
            coefficients(PROBLEM, 1.0),
            drive=st.Pusher(height=0.07, width=0.01),
            tilt=1.0,
            problem={"friction": st.LinearWeakening(weakening_rate=1e11, residual_ratio=0.8)},
        ),
    ),
    "a material contrast": (
        "specimen.base.solid ... up to 1.4 ... got 1.7",
        sampled(coefficients(PROBLEM, 1.6), base=st.Base(height=0.03, solid=STIFF)),
    ),
    "another plane state": (
        "base.solid.plane ... 'stress'",
        sampled(base=st.Base(height=0.03, solid=dataclasses.replace(STIFF, plane="strain"))),
    ),
    "mode III": ("mode ... 'II'", sampled(problem={"mode": "III"})),
    "stresses": ("strength ... friction coefficients ... unit 1", sampled(np.full(64, 3e6))),
    "a residual stress": (
        "residual_strength ... friction coefficients",
        sampled({"strength": MU, "residual_strength": 1e6}, problem={
            "friction": st.LinearWeakening(weakening_rate=1e11)
        }),
    ),
    "a residual stress in the law": (
        "friction.residual_strength ... residual_ratio",
        sampled(problem={
            "friction": st.LinearWeakening(weakening_rate=1e11, residual_strength=1e6)
        }),
    ),
    "an initial stress": ("initial_stress", sampled({"strength": MU, "initial_stress": 1e5})),
    "an initial stress of the load": (
        "load.initial_stress",
        sampled(problem={"load": st.Load(initial_stress=1e5, pressing_force=4e3)}),
    ),
    "an extent": (
        "interface.extent",
        sampled(problem={"interface": st.Interface(0.14, 64, extent=(0.02, 0.1))}),
    ),
    "no pressure": ("load ... normal force", sampled(problem={"load": st.Load()})),
    "a profile of the pressure": (
        "load.normal_pressure ... pressing_force",
        sampled(problem={"load": st.Load(normal_pressure=np.linspace(1e6, 2e6, 64))}),
    ),
    "a pressure along a sample": (
        "load.pressing_force ... no effect ... normal_pressure: follows from the rig",
        sampled({"strength": MU, "normal_pressure": np.linspace(1e6, 2e6, 64)}),
    ),
    "random stresses": (
        "random.strength ... friction coefficients",
        lambda: st.monte_carlo(PROBLEM, beta_strength(0.01), method=EXACT, samples=1),
    ),
    "the local criterion": (
        "local criterion ... pressure ... st.Equilibrium()",
        lambda: st.onset(PROBLEM, MU, method=LOCAL),
    ),
    "ruptures": (
        "rupture ... equal blocks ... st.Equilibrium()",
        lambda: st.simulate_rupture(PROBLEM, MU, method=st.Rupture()),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_slider_does_not_take(name):
    refuses(*REFUSED[name])


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
    refuses("strength", lambda: st.plot.specimen(problem))
    rig, stresses, slip = st.plot.specimen(problem, coefficients(problem))
    shear, pressure, peak = (line.get_ydata() for line in stresses.lines)
    moved = slip.lines[0].get_ydata()
    assert rig.get_aspect() == 1.0  # to scale
    assert np.all(shear <= peak + 1e-9)
    np.testing.assert_allclose(peak, coefficients(problem) * pressure)
    assert moved[0 if side == "left" else -1] == moved.max() > 0.0


def test_a_coarse_grid_is_warned_of_without_free_ends():
    """The end of a slider is a corner, for which the critical length of free ends does not hold."""
    (text,) = warning_texts(lambda: st.onset(PROBLEM, MU, method=EXACT))
    assert "spans 7.9 nodes, and 32 are recommended" in text
