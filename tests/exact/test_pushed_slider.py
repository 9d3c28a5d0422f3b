"""Laws of statics along the path of a slider, and the same rig described in two ways."""

import numpy as np
import pytest
from setups import examples
from sliders import coefficients, rig_problem

import stiction as st
from stiction.methods.equilibrium import slider as module

PUSH = st.Pusher(height=0.006, width=0.004)
DRIVES = examples("drives of sliders")


def solved(problem, mu, **options):
    return st.onset(problem, mu, method=st.Equilibrium(**options), progress=False)


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize("name", DRIVES)
def test_forces_balance_along_the_path(name):
    problem = rig_problem(drive=DRIVES[name], tilt=-0.5 if name == "tilted, high" else 0.0)
    mu, slider = coefficients(problem), problem.specimen
    found = solved(problem, mu)
    loads = float(found.critical_load[0]) * np.linspace(0.0, 1.0, 40)
    path = st.equilibrium_path(problem, mu, loads)
    assert not path.sliding.any()
    mean = 4e3 / (0.14 * 0.006)
    np.testing.assert_allclose(path.pressure.mean("x"), mean, rtol=1e-11)
    # Pressure and shear obey the law, up to round-off.
    limit = path.pressure * mu
    assert (path.stress <= limit + 1e-9 * mean).all()
    assert (path.slip.diff("load") >= -1e-15).all()
    assert float(path.mean_stress.max()) <= float(found.critical_stress[0]) * (1.0 + 1e-12)
    assert int(path.arrested_events[-1]) == (path.event_load < loads[-1]).sum()
    # The friction coefficient is the largest force over the normal force.
    assert found.friction_coefficient[0] == pytest.approx(float(found.critical_force[0]) / 4e3)
    machine = slider.drive.stiffness
    if machine == np.inf:  # the machine prescribes the travel
        np.testing.assert_allclose(path.travel, path.crosshead_travel, rtol=1e-12)
    assert np.isnan(path.crosshead_travel).all() == (machine == 0.0)
    if machine > 0.0:
        along = path.crosshead_travel[1:] / loads[1:]
        np.testing.assert_allclose(along, along[0], rtol=1e-9)


def test_a_slider_that_topples_before_it_slides():
    # The pressure reaches the leading end at h F/N = L/2.
    problem = rig_problem(height=0.14, drive=st.Pusher(height=0.13, width=0.01))
    mu = coefficients(problem, 0.88, amplitude=0.01)
    with pytest.warns(st.AccuracyWarning, match="topples"):
        found = solved(problem, mu)
    assert float(found.friction_coefficient[0]) == pytest.approx(0.07 / 0.13, rel=1e-9)


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_the_pressing_may_begin_at_any_small_share(monkeypatch):
    problem = rig_problem(drive=PUSH)
    mu = coefficients(problem, 0.28, amplitude=0.02)
    loads = {}
    for share in (1e-2, 1e-3, 1e-4):
        monkeypatch.setattr(module, "FIRST_PRESSING", share)
        found = solved(problem, mu)
        loads[share] = float(found.first_instability[0]), float(found.critical_load[0])
    np.testing.assert_allclose(loads[1e-2], loads[1e-3], rtol=5e-8)
    np.testing.assert_allclose(loads[1e-4], loads[1e-3], rtol=5e-8)
