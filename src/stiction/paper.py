"""The system of Albertini, Karrer, Grigoriu and Kammer (2020), for examples and tests.

This file uses only public names of the package, which are imported on
first use, so that a `Problem` does not load random fields.
"""

from __future__ import annotations

from typing import Literal

import stiction as st
from stiction.base.model import Positive, checked

__all__ = ["problem", "strength"]


def __dir__() -> list[str]:  # what completion lists
    return __all__


def problem(nodes: int = 1024, plane: Literal["stress", "strain"] = "stress") -> st.Problem:
    """Return the problem of Albertini, Karrer, Grigoriu and Kammer (2020).

    The problem is in mode II, with G = 1 GPa, nu =
    0.33, rho = 1170 kg/m3, L = 0.1 m and W = 0.5 TPa/m.
    Only the strength above the residual strength
    affects the onset, so the residual strength is zero.

    Parameters
    ----------
    nodes : int
        Number of nodes on the interface, even.
    plane : {"stress", "strain"}
        The paper states plane stress, for which G* = G (1 + nu), but
        prints G* = G/(1 - nu), which belongs to plane strain.
        ``plane="strain"`` gives the printed value.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> round(problem.nucleation_length / (2.0 * 0.5788869 * 1.33e9 / 0.5e12), 6)  # G* = G (1 + nu)
    1.0
    >>> strain = st.paper.problem(nodes=512, plane="strain")
    >>> round(strain.nucleation_length / problem.nucleation_length, 6) == round(1 / 0.67 / 1.33, 6)
    True
    """
    return st.Problem(
        solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane=plane),
        interface=st.Interface(length=0.1, nodes=nodes),
        friction=st.LinearWeakening(weakening_rate=0.5e12, residual_strength=0.0),
    )


@checked
def strength(problem: st.Problem, correlation_ratio: Positive = 0.5) -> st.RandomField:
    """Return the random strength of Albertini et al. (2020, Eqs. 2 to 7).

    The marginal is Beta(1.5, 3) on [0.66, 1.66] MPa. The spectrum is
    the power law (k^2 + lambda^2)^-4, truncated at 2.5 lambda, without
    the mean mode.

    Parameters
    ----------
    problem : Problem
        Problem whose nucleation length h_n sets the scale.
    correlation_ratio : float
        Ratio xi_0/h_n, positive, with xi_0 = 2 pi/lambda.

    The mean of the marginal is 0.66 + 1.5/4.5 MPa.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.75)
    >>> round(strength.mean / 1e6, 6)
    0.993333
    >>> round(strength.spectrum.correlation_length / problem.nucleation_length, 9)
    0.75
    """
    length = correlation_ratio * problem.nucleation_length
    return st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=length, exponent=4.0),
    )
