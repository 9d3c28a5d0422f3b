"""The table of events beside cracks of known slip, and beside energies and histories of a run."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from oracles import dense, symbol_of
from refusals import warning_texts
from setups import QUARTER, make_problem, within

import stiction as st
from stiction.methods.dynamics.summary import rate_spectrum
from stiction.methods.equilibrium.events import ArrestedEvent, event_table, event_variables
from stiction.methods.equilibrium.state import EquilibriumState

DROP = 2e5


def table_of_crack(problem, inside):
    """The table of an event that lowers the stress by `DROP` in a crack, by dense algebra."""
    shape = problem.interface.shape
    nodes, slip = np.flatnonzero(inside), np.zeros(shape)
    stiffness = dense(symbol_of(problem), shape)[np.ix_(nodes, nodes)]
    slip[inside] = np.linalg.solve(stiffness, np.full(nodes.size, DROP))
    rows = problem.sample(np.full(shape, 1e6))
    still = np.zeros(slip.size)
    before = EquilibriumState(DROP, still, still)  # the residual strength is zero
    event = ArrestedEvent(before, dataclasses.replace(before, slip=slip.ravel()))
    table = event_table(problem, rows, 0, [event], event_variables(problem.interface))
    return {name: values[0] for name, values in table.items()}


@pytest.mark.parametrize("mode", ["II", "III"])
def test_a_crack_on_a_line_is_starrs(mode):
    problem = make_problem(512, 0.1, mode=mode)
    inside = np.abs(np.arange(512) - 200) <= 40
    found, modulus = table_of_crack(problem, inside), problem.effective_modulus
    # In a row of cracks a period L apart, pi a²/2 becomes -(L²/pi) ln cos(pi a/L). Tips between
    # nodes make a crack of 81 nodes look longer or shorter by less than a node.
    half, period = found["event_length"] / 2, 0.1
    # Starr (1928): pi drop a² G/G*.
    single = np.pi * DROP * half**2 * problem.solid.shear_modulus / modulus
    row = -2.0 * (period / (np.pi * half)) ** 2 * np.log(np.cos(np.pi * half / period))
    assert found["event_moment"] == pytest.approx(single * row, rel=2.0 / 81)
    assert found["event_largest_slip"] == pytest.approx(2 * DROP * half / modulus, rel=0.04)
    for name in ("area", "slip", "energy"):
        assert found[f"event_{name}_stress_drop"] == pytest.approx(DROP, rel=1e-10)


def test_a_circular_crack_is_eshelbys():
    problem = make_problem((64, 60), (0.1, 0.09375), solid=QUARTER, weakening_rate=5e10)
    places = np.meshgrid(np.arange(64) - 30, np.arange(60) - 25, indexing="ij")
    inside = np.hypot(*places) <= 9.5
    found = table_of_crack(problem, inside)
    # Eshelby (1957): 16 (1 - nu)/(3 (2 - nu)) drop a³, at nu = 1/4.
    exact = 16 / 7 * DROP * np.sqrt(found["event_area"] / np.pi) ** 3
    # A rim between nodes: half a node of 9.5, three times.
    assert found["event_moment"] == pytest.approx(exact, rel=1.5 / 9.5)
    magnitude = (np.log10(found["event_moment"]) - 9.1) / 1.5
    assert found["event_magnitude"] == pytest.approx(magnitude)


@pytest.mark.parametrize(("inner", "unit"), [(0, 1.0), (300, 1.0), (300, 1e-3)])
def test_a_spectrum_is_that_of_the_lines_between_the_times(inner, unit):
    """A triangle of any knots has the spectrum M sinc²(f T), from one period in all.

    Up to eight nodes in a shear wave, and two times in a period, but at least two periods in all.
    """
    problem = make_problem((64, 60), (0.1, 0.11), weakening_rate=5e10)
    knots = np.random.default_rng(1).uniform(0.0, 2.0, inner)
    time = unit * np.sort(np.concatenate([[0.0, 1.0, 2.0], knots]))
    rate = 7.0 / unit * (1.0 - np.abs(time / unit - 1.0))
    frequencies, amplitude = rate_spectrum(problem, 5.0 * unit + time, rate)
    np.testing.assert_allclose(
        amplitude[0], 7.0 * np.sinc(frequencies[0] * unit) ** 2, atol=1e-9
    )
    wave = problem.solid.shear_wave_speed / (8.0 * 0.11 / 60)
    highest = max(1.0 / unit, min(wave, 0.5 / np.median(np.diff(time))))
    assert frequencies[0][[0, -1]] == pytest.approx([0.5 / unit, highest])
    assert rate_spectrum(problem, time[:2], rate[:2])[0][0].size == 0


@pytest.mark.parametrize(
    ("stop", "text"), [("sliding", "cross the nucleation length"), ("onset", "explicit step")]
)
def test_fast_loading_is_warned_of_and_the_rate_that_is_named_is_slow_enough(stop, text):
    """Also rounded to a digit, which may halve it, and as the least of a range."""
    problem = make_problem(128, 0.05, mode="III", residual_strength=2e5)
    problem = within(problem, (0.01, 0.03))
    x = problem.interface.x
    strength = 1e6 - 2e5 * np.exp(-(((x - 0.017) / 0.003) ** 2)) - 5e4 * np.cos(600.0 * x)
    strength = strength + 2e6 * np.outer([0.0, 1.0, 0.0], x > 0.02)

    def told(rate: float) -> list[str]:
        method = st.Rupture(loading_rate=rate, stop=stop)
        texts = warning_texts(lambda: st.onset(problem, strength, method=method))
        return [line for line in texts if line.startswith("loading_rate") and text in line]

    (fast,) = told(3e10 if stop == "sliding" else 1.2e11)
    named = float(re.search(r"Load at (\S+) .*Pa/s or slower", fast)[1])
    assert told(2.1 * named)
    assert not told(named)
    assert stop == "onset" or named < 1e9
