"""The paper's setting, and the names of `stiction` that the other files share."""

import dataclasses
from pathlib import Path

import numpy as np

import stiction as st
from reproduction import PARAMETERS

RATIOS = (0.25, 0.5, 1.0, 2.0)
"""xi_0/h_n of the paper's Monte Carlo study."""
SIMULATED = (0.25, 0.5, 2.0)
"""xi_0/h_n at which the paper ran 20 simulations each."""

NAMES = ("shear_modulus", "poisson_ratio", "density", "length", "nodes", "weakening_rate",
         "alpha", "beta", "low", "high")  # fmt: skip
"""Parameters that a reader may replace, in SI units; the last four are those of the strength."""
if _unknown := sorted(set(PARAMETERS) - set(NAMES)):
    raise st.InputError(f"unknown {_unknown[0]!r} (valid: {', '.join(NAMES)})")


def _replaced(part):
    """Return a part of the paper's problem with the parameters that replace its own."""
    names = {field.name for field in dataclasses.fields(part)} & set(PARAMETERS)
    return dataclasses.replace(part, **{name: PARAMETERS[name] for name in names})


def _problem(plane: str = "stress"):
    problem = st.paper.problem(plane=plane)
    parts = {name: getattr(problem, name) for name in ("solid", "interface", "friction")}
    return dataclasses.replace(problem, **{k: _replaced(part) for k, part in parts.items()})


PROBLEM = _problem()
H = PROBLEM.nucleation_length
"""Nucleation length h_n in plane stress, m."""
L = PROBLEM.interface.extent
G_STAR = PROBLEM.effective_modulus
W = PROBLEM.uniform_rate
"""Weakening rate, Pa/m."""
STRAIN = _problem("strain")
"""The same with the printed modulus, G/(1 - nu), which belongs to plane strain."""
PRINTED_H = STRAIN.nucleation_length

MARGINAL = _replaced(st.paper.strength(PROBLEM).marginal)
LOW, HIGH = MARGINAL.low, MARGINAL.high
MEAN = MARGINAL.distribution.mean()
DEVIATION = MARGINAL.distribution.std()

LOADING_RATE = 2e7
"""Of the ruptures, Pa/s; the paper does not give its own."""
WHAT_IF = Path(__file__).parent / "what_if"


def strength(ratio: float, **changes):
    """Return the paper's random strength at xi_0/h_n; `changes` replace parts of the field."""
    length = changes.pop("nucleation_length", H)
    spectrum = dataclasses.replace(
        st.paper.strength(PROBLEM).spectrum, correlation_length=ratio * length
    )
    return st.RandomField(marginal=MARGINAL, spectrum=spectrum, **changes)


def grid(problem, *, length: float = 1.0, nodes: float = 1.0):
    """Return the problem with its length and its number of nodes multiplied."""
    interface = problem.interface
    changed = st.Interface(
        length=interface.extent * length, nodes=2 * round(0.5 * interface.size * nodes)
    )
    return dataclasses.replace(problem, interface=changed)


def distance(one, other, period: float = L):
    """Return the distance of positions on the periodic interface, m."""
    gap = np.abs(np.asarray(one) - np.asarray(other)) % period
    return np.minimum(gap, period - gap)


def discrete_weights(problem=PROBLEM):
    """Return the window of the local criterion that is strict on the grid, of unit sum.

    The narrowest window of nodes whose stiffness has a smallest eigenvalue of at most the
    weakening rate. Its positive eigenvector v gives a bound: no equilibrium exists above
    sum(v tau_p), whatever the patches elsewhere do.
    """
    from scipy.linalg import eigh, toeplitz

    interface = problem.interface
    wavenumber = 2.0 * np.pi * np.abs(np.fft.fftfreq(interface.size, interface.spacing))
    column = np.fft.ifft(0.5 * problem.effective_modulus * wavenumber).real
    width = max(round(problem.nucleation_length / interface.spacing) - 4, 1)
    while True:
        value, vector = eigh(toeplitz(column[:width]), subset_by_index=[0, 0])
        if value[0] <= W:
            weights = np.abs(vector[:, 0])
            return weights / weights.sum()
        width += 1
