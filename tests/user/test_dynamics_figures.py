"""Figures and film of a rupture, from a small run."""

import numpy as np
import pytest
from PIL import Image

import stiction as st
from stiction import InputError
from stiction.dynamics.method import Rupture
from stiction.dynamics.simulate import simulate_rupture
from stiction.plot import film


@pytest.fixture(scope="module")
def simulated():
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
    problem = st.Problem(
        solid, st.Interface(length=0.05, nodes=128), st.LinearWeakening(weakening_rate=0.2e12)
    )
    x = problem.interface.x
    tau_p = 1e6 - 2e5 * np.cos(2 * np.pi * x / 0.05) + 5e4 * np.sin(10 * np.pi * x / 0.05)
    method, save = Rupture(loading_rate=1e8), st.Save(every=5)
    return problem, simulate_rupture(problem, tau_p, method=method, save=save)


def test_units_follow_the_size_of_the_fault(simulated):
    problem, run = simulated
    axes = st.plot.rupture(run)
    assert axes.get_xlabel() == "position $x$ (mm)"
    assert axes.get_ylabel() == "time since the onset (µs)"
    weak = st.LinearWeakening(weakening_rate=0.2e6)
    large = st.Problem(problem.solid, st.Interface(length=5e4, nodes=128), weak)
    run = run.assign_coords(time=run.time * 1e6)
    axes = st.plot.rupture(run.assign(onset_time=run.onset_time * 1e6), problem=large)
    assert axes.get_xlabel() == "position $x$ (km)"
    assert axes.get_ylabel() == "time since the onset (s)"


def test_a_rupture_that_begins_at_once_is_drawn(simulated, tmp_path):
    _, run = simulated
    at_once = run.assign(onset_time=run.onset_time * 0.0)
    for whole in (False, True):
        st.plot.rupture(at_once, whole=whole).figure.savefig(tmp_path / "rupture.png")
    assert film(at_once, tmp_path / "film.gif", frames=2).exists()


def test_film_moves(simulated, tmp_path):
    _, run = simulated
    path = film(run, tmp_path / "film.gif", frames=6)
    moving = Image.open(path)
    assert moving.n_frames == 6
    first = np.asarray(moving.convert("RGB")).astype(int)
    moving.seek(5)
    assert np.abs(np.asarray(moving.convert("RGB")) - first).max() > 50


def test_what_is_missing_is_named(simulated, tmp_path):
    _, run = simulated
    with pytest.raises(InputError, match=r"\.gif, got 'film\.avi'"):
        film(run, tmp_path / "film.avi")
    with pytest.raises(InputError, match="has no slip_rate"):
        st.plot.rupture(run.drop_vars("slip_rate"))
