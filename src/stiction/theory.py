"""Theory of the local criterion and of cracks: results without an ensemble.

The exact mean and variance of the nucleation stress are computed here.
"""

from dataclasses import dataclass

import numpy as np

from stiction.base.errors import InputError
from stiction.base.model import checked
from stiction.base.representation import Result, Row, Summary
from stiction.methods.criterion.griffith import griffith_length
from stiction.methods.criterion.local import check_law, nucleation_stress
from stiction.methods.criterion.windows import windows_of
from stiction.problem.problem import Problem, refuse_specimen
from stiction.random.fields import RandomField

__all__ = ["griffith_length", "nucleation_statistics", "nucleation_stress"]


def __dir__() -> list[str]:  # what completion lists
    return __all__


@dataclass(frozen=True, eq=False, repr=False)
class NucleationStatistics(Result):
    """Mean and variance of the nucleation stress tau_n at a point. tau_n is a load tau_0.

    Attributes
    ----------
    mean, variance : float
        E[tau_n], Pa, and Var[tau_n], Pa^2.
    strength_mean, strength_variance : float
        E[tau_p], Pa, and Var[tau_p], Pa^2.

    >>> found = NucleationStatistics(
    ...     mean=3.0, variance=4.0, strength_mean=5.0, strength_variance=16.0
    ... )
    >>> found.variance_ratio, [row.value for row in found._summary().rows]
    (0.25, [3.0, 2.0, 5.0, 4.0])
    """

    mean: float
    variance: float
    strength_mean: float
    strength_variance: float

    def _summary(self) -> Summary:
        values = {
            "mean": self.mean,
            "standard deviation": self.variance**0.5,
            "mean of the strength": self.strength_mean,
            "its standard deviation": self.strength_variance**0.5,
        }
        rows = [Row(name, value, (), "Pa") for name, value in values.items()]
        return Summary("Nucleation stress at a point, exact moments", rows)

    @property
    def variance_ratio(self) -> float:
        """Var[tau_n]/Var[tau_p]."""
        return self.variance / self.strength_variance


@checked
def nucleation_statistics(problem: Problem, strength: RandomField) -> NucleationStatistics:
    """Compute the exact mean and variance of the nucleation stress.

    Parameters
    ----------
    problem : Problem
        A problem with uniform weakening rate, load and initial stress.
    strength : RandomField
        Peak strength, Pa, or friction coefficients under a uniform
        normal pressure.

    Raises
    ------
    InputError
        If the weakening rate, the load, the initial stress or the
        pressure of coefficients varies along the interface, or if a
        critical patch is larger than the interface.

    Notes
    -----
    Albertini et al. (2020, Eqs. B.2 and B.3): E[tau_n] = E[tau_p], and
    Var[tau_n] is the double integral of the correlation of tau_p and
    the weights. On a periodic interface, the integral is a sum over
    wave vectors of the spectrum of tau_p times the squared transform of
    the weight. The correlation of tau_p follows from a Hermite
    expansion (Grigoriu, 1995).

    On a plane tau_n is the average over the middle ellipse of
    `LocalCriterion`. The method takes the minimum over several
    ellipses, which has no closed-form moments.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> found = st.theory.nucleation_statistics(problem, strength)
    >>> bool(0.0 < found.variance_ratio < 1.0)  # averaging lowers the variance
    True

    A load of 2 halves the stress, and an initial stress lowers its mean alone.

    >>> from dataclasses import replace
    >>> load = replace(problem.load, profile=2.0, initial_stress=2e5)
    >>> other = st.theory.nucleation_statistics(replace(problem, load=load), strength)
    >>> mean = 0.66e6 + 1e6 / 3.0  # of Beta(1.5, 3) on [0.66, 1.66] MPa
    >>> round(found.mean / mean, 4), round(2.0 * other.mean / (mean - 2e5), 4)
    (1.0, 1.0)
    >>> round(other.variance / found.variance, 6), round(other.strength_mean / mean, 4)
    (0.25, 1.0)
    """
    scale, load, initial = stationary(problem, strength)
    weakening_rate = problem.friction.uniform_weakening_rate
    assert weakening_rate is not None  # checked by `stationary`
    (window,) = windows_of(problem, weakening_rate, stretches=(1.0,))
    # The spectrum of the strength is the transform of its correlation, and
    # a mode includes its conjugate.
    interface = problem.interface
    power = interface.transform(strength.correlation(interface)).real / interface.size
    power[..., 1 : interface.shape[-1] // 2] *= 2.0
    power = np.maximum(power, 0.0) * np.abs(window.spectrum) ** 2
    mean, variance = scale * strength.mean, (scale * strength.standard_deviation) ** 2
    return NucleationStatistics(
        mean=(mean - initial) * window.total / load,
        variance=float(np.sum(power)) * variance / load**2,
        strength_mean=mean,
        strength_variance=variance,
    )


def stationary(problem: Problem, strength: RandomField) -> tuple[float, float, float]:
    """Return the unit of the strength (Pa), the load profile and the initial stress, all uniform.

    The unit of friction coefficients is the normal pressure. Raises an
    `InputError` if a value varies along the interface.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> stationary(problem, strength)
    (1.0, 1.0, 0.0)
    >>> from dataclasses import replace
    >>> load = replace(problem.load, initial_stress=np.linspace(0.0, 9.0, 256))
    >>> varying = replace(problem, load=load)
    >>> stationary(varying, strength)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: load.initial_stress: varies, so the nucleation stress ...
    """
    check_law(problem)
    refuse_specimen(problem, "this theory", "Sample the nucleation stress with st.monte_carlo")
    load, initial = problem.load_profile, problem.load.initial_stress
    pressure = 1.0 if strength.quantity is None else problem.given_pressure
    if pressure is None:
        raise InputError("load.normal_pressure: is needed for strength in coefficients (Pa)")
    varying = {
        "load.profile: varies": np.ptp(load) > 0.0,
        "load.initial_stress: varies": np.ptp(initial) > 0.0,
        "load.normal_pressure: varies, and strength is in coefficients": np.ptp(pressure) > 0.0,
        "strength: is conditioned on measured values": strength.conditions is not None,
        "friction.weakening_rate: varies or follows from the strength": (
            problem.friction.uniform_weakening_rate is None
        ),
    }
    why = "so the nucleation stress is not stationary. Sample it with st.monte_carlo instead"
    if problems := [f"{what}, {why}" for what, varies in varying.items() if varies]:
        raise InputError(problems)
    return float(np.max(pressure)), float(np.max(load)), float(np.max(initial))
