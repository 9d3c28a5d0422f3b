"""Figures and film of a rupture, from a small run."""

import matplotlib.figure
import numpy as np
import pytest
from PIL import Image

import stiction as st
from stiction import InputError
from stiction.dynamics.method import Rupture
from stiction.dynamics.simulate import simulate_rupture
from stiction.plot import film
from stiction.report.rupture_figures import front_figure, rupture_figure


@pytest.fixture(scope="module")
def simulated():
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
    problem = st.Problem(
        solid, st.Interface(length=0.05, nodes=128), st.LinearWeakening(weakening_rate=0.2e12)
    )
    x = problem.interface.x
    tau_p = 1e6 - 2e5 * np.cos(2 * np.pi * x / 0.05) + 5e4 * np.sin(10 * np.pi * x / 0.05)
    return problem, simulate_rupture(problem, tau_p, method=Rupture(loading_rate=1e8), every=5)


def test_space_time_figure_has_its_four_panels(simulated, tmp_path):
    problem, run = simulated
    figure = rupture_figure(run, problem)
    assert isinstance(figure, matplotlib.figure.Figure)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert r"$\tau_\mathrm{p}$ (MPa)" in labels
    assert r"$t - T$ (µs)" in labels
    figure.savefig(tmp_path / "figure.png")
    assert Image.open(tmp_path / "figure.png").size[0] > 500


def test_front_figure_names_the_wave_speeds(simulated):
    problem, run = simulated
    texts = {text.get_text() for axes in front_figure(run, problem).axes for text in axes.texts}
    assert {"$c_R$", "$c_s$", "$c_d$"} <= texts


def test_film_moves(simulated, tmp_path):
    _, run = simulated
    path = film(run, tmp_path / "film.gif", pictures=6)
    moving = Image.open(path)
    assert moving.n_frames == 6
    first = np.asarray(moving.convert("RGB")).astype(int)
    moving.seek(5)
    assert np.abs(np.asarray(moving.convert("RGB")) - first).max() > 50


def test_what_is_missing_is_named(simulated, tmp_path):
    problem, run = simulated
    with pytest.raises(InputError, match=r"\.gif or \.mp4, got 'film\.avi'"):
        film(run, tmp_path / "film.avi")
    with pytest.raises(InputError, match="has no slip_rate"):
        rupture_figure(run.drop_vars("slip_rate"), problem)
