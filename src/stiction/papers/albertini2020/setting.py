"""The system of the paper: its parameters, written once."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, Literal

from pydantic import model_validator

from stiction._checks import check_instance, is_finite
from stiction._model import Positive, describe, model
from stiction.errors import InputError
from stiction.friction.linear import SlipWeakening
from stiction.interface import Interface
from stiction.problem import Problem
from stiction.random.marginals import Beta, Marginal
from stiction.random.random_field import RandomField
from stiction.random.spectra import PowerLawSpectrum
from stiction.solid import Solid

CORRELATION_RATIOS = (0.25, 0.5, 1.0, 2.0)
"""xi_0/h_n of the paper's Monte Carlo study."""
SIMULATED_RATIOS = (0.25, 0.5, 2.0)
"""xi_0/h_n at which the paper ran its simulations, 20 at each."""


def problem(nodes: int = 1024, plane: Literal["stress", "strain"] = "stress") -> Problem:
    """The interface of Albertini, Karrer, Grigoriu and Kammer (2020).

    G = 1 GPa, nu = 0.33, rho = 1170 kg/m3, L = 0.1 m, W = 0.5 TPa/m, mode II. The strength above
    the residual is all that matters to the onset, so the residual is zero.

    Parameters
    ----------
    nodes : int
        Number of nodes on the interface, even.
    plane : {"stress", "strain"}
        The paper says plane stress, where G* = G (1 + nu), but prints G* = G/(1 - nu), which
        belongs to plane strain; ``plane="strain"`` gives the printed value.

    Returns
    -------
    Problem

    Raises
    ------
    InputError
        If the plane state is unknown or the nodes are too few.
    """
    return Problem(
        solid=Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane=plane),
        interface=Interface(length=0.1, nodes=nodes),
        friction=SlipWeakening(weakening_rate=0.5e12, residual_strength=0.0),
    )


def strength(problem: Problem, correlation_ratio: float = 0.5) -> RandomField:
    """The random strength of Albertini et al. (2020, Eqs. 2 to 7).

    Beta(1.5, 3) on [0.66, 1.66] MPa; power-law spectrum (k^2 + lambda^2)^-4, truncated at
    2.5 lambda, without the mean mode.

    Parameters
    ----------
    problem : Problem
        Its nucleation length h_n sets the scale.
    correlation_ratio : float
        xi_0/h_n, positive; xi_0 = 2 pi/lambda.

    Returns
    -------
    RandomField

    Raises
    ------
    InputError
        If the ratio is not positive, or h_n is not defined because W varies.
    """
    check_instance("problem", problem, Problem)
    if not (is_finite(correlation_ratio) and correlation_ratio > 0.0):
        given = describe(correlation_ratio)
        raise InputError(f"correlation_ratio: must be a positive number, got {given}")
    return RandomField(
        marginal=Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=PowerLawSpectrum(
            correlation_length=correlation_ratio * problem.nucleation_length,
            exponent=4.0,
            truncation=2.5,
        ),
    )


@model(kw_only=True)
class Setting:
    """What the studies of the paper are run for; another one changes figures and verdicts.

    Parameters
    ----------
    problem : Problem
        With a uniform weakening rate.
    marginal : Beta or frozen continuous scipy.stats distribution
    exponent, truncation : float
        Of the power-law spectrum.
    mean_mode : bool
        Whether the Gaussian field has the mode k = 0.
    correlation_ratios : tuple of float
        xi_0/h_n of the Monte Carlo study, rising, two to six of them.
    simulated_ratios : tuple of float
        xi_0/h_n of the elastodynamic ruptures, rising, one to six of them.
    """

    problem: Problem = problem()
    marginal: Marginal = Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
    exponent: Positive = 4.0
    truncation: Positive = 2.5
    mean_mode: bool = False
    correlation_ratios: tuple[Positive, ...] = CORRELATION_RATIOS
    simulated_ratios: tuple[Positive, ...] = SIMULATED_RATIOS

    @model_validator(mode="after")
    def _rising(self) -> Setting:
        problems = []
        for name, fewest in (("correlation_ratios", 2), ("simulated_ratios", 1)):
            ratios = getattr(self, name)
            rising = all(left < right for left, right in pairwise(ratios))
            if not (rising and fewest <= len(ratios) <= 6):
                problems.append(f"{name}: must be {fewest} to 6 rising numbers, got {ratios!r}")
        if problems:
            raise InputError(problems)
        return self

    def field(self, correlation_ratio: float, **changes: Any) -> RandomField:
        """The random strength at xi_0/h_n; `changes` replace marginal, exponent, mean_mode, ...

        Parameters
        ----------
        correlation_ratio : float
        **changes
            `marginal`, `exponent`, `truncation`, `power_kept`, `mean_mode`, or
            `nucleation_length` (m) in place of the problem's own.
        """
        return RandomField(
            marginal=changes.get("marginal", self.marginal),
            spectrum=self.spectrum(correlation_ratio, **changes),
            mean_mode=changes.get("mean_mode", self.mean_mode),
        )

    def spectrum(self, correlation_ratio: float, **changes: Any) -> PowerLawSpectrum:
        """The spectrum of `field`."""
        length = changes.get("nucleation_length", self.problem.nucleation_length)
        kept = changes.get("power_kept")
        return PowerLawSpectrum(
            correlation_length=correlation_ratio * length,
            exponent=changes.get("exponent", self.exponent),
            truncation=None if kept else changes.get("truncation", self.truncation),
            power_kept=kept,
        )

    @property
    def bounds(self) -> tuple[float, float]:
        """Support of the strength, Pa; infinite where it has no bound."""
        low, high = self.marginal.distribution.support()
        return float(low), float(high)

    @property
    def mean(self) -> float:
        """Mean strength <tau_p>, Pa."""
        return float(self.marginal.distribution.mean())
