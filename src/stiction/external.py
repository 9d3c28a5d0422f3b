"""Functions for external programs: samplers, reliability codes, tables, the SCEC comparison."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import (
    Count,
    Names,
    NotNegative,
    Number,
    RealArray,
    check,
    checked,
    describe,
)
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import limit_state
from stiction.inference.likelihood import Simulation, simulate
from stiction.inference.prior import with_parameters
from stiction.methods.dynamics.scec import write_scec
from stiction.methods.protocol import MethodObject
from stiction.problem.problem import Problem
from stiction.random.fields import RandomField, RandomInterface, as_random_interface
from stiction.study.run import event_table

__all__ = ["event_table", "limit_state", "simulator", "write_scec"]


def __dir__() -> list[str]:  # what completion lists
    return __all__


@checked
def simulator(
    problem: Problem,
    random: RandomInterface | RandomField,
    parameters: Names,
    *,
    method: MethodObject,
    samples: Count,
    seed: Number = 0,
    load_cell_error: NotNegative = 0.0,
) -> Callable[..., Array]:
    """Return a function that simulates the peaks of repeated tests, for dynesty or sbi.

    Parameters
    ----------
    problem, random, method, seed
        As in `infer`.
    parameters : sequence of str
        Keys, as in the prior of `infer`, for example
        ``("correlation_length", "marginal.low")``.
    samples : int
        Number of tests to simulate in each call.
    load_cell_error : float
        Standard error of a peak, Pa.

    Returns
    -------
    callable
        A function that can be pickled for other processes.
        ``simulate(theta)`` returns an array (samples,) of
        peaks, Pa, for an array theta with a number for each
        parameter. ``simulate(theta, first=k)`` returns the
        peaks of samples k, k + 1, ... If k >= samples, these
        peaks are independent of the first call. The samples
        are the same for all theta, so peaks are smooth functions of theta.

    Raises
    ------
    InputError
        If an argument is invalid or a parameter does not exist. The
        returned function raises an `InputError` if the values of the
        parameters give an invalid problem.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
    >>> keys = ("correlation_length", "marginal.low")
    >>> simulate = st.external.simulator(
    ...     problem, strength, keys, method=st.LocalCriterion(), samples=25
    ... )
    >>> simulate([2e-3, 0.66e6]).shape
    (25,)

    Samples from another first one are others, and the error of the load cell is
    added to the same peaks.

    >>> first, later = simulate([2e-3, 0.66e6]), simulate([2e-3, 0.66e6], first=5)
    >>> bool(np.array_equal(first[5:], later[:20]))
    True
    >>> noisy = st.external.simulator(
    ...     problem, strength, keys, method=st.LocalCriterion(), samples=25, load_cell_error=1e3
    ... )
    >>> noise = noisy([2e-3, 0.66e6]) - first
    >>> 600.0 < float(noise.std()) < 1400.0
    True
    >>> abs(float(noise.mean())) < 600.0
    True
    >>> simulate([2e-3, 0.66e6, 1.0])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: theta: must be 2 finite numbers, correlation_length...
    """
    interface = as_random_interface(random)
    unknown: list[str] = []
    for name in parameters:  # only unknown names are wrong for any values
        try:
            with_parameters(problem, interface, (name,), np.ones(1))
        except InputError as error:
            unknown += [text for text in error.problems if "unknown" in text]
    if unknown:
        raise InputError(unknown)
    return partial(
        _peaks_at, problem, interface, parameters, Simulation(method, samples, seed),
        load_cell_error,
    )  # fmt: skip


def _peaks_at(
    problem: Problem, random: RandomInterface, parameters: Names, simulation: Simulation,
    error: float, theta: Any, *, first: int = 0,
) -> Array:  # fmt: skip
    """Return the peaks (samples,), Pa, of samples first, first + 1, ... at parameters theta."""
    first = check("first", first, Number)
    values = check("theta", theta, RealArray)
    if values.shape != (len(parameters),) or not np.isfinite(values).all():
        raise InputError(
            f"theta: must be {len(parameters)} finite numbers, {', '.join(parameters)}, got"
            f" {describe(theta)}"
        )
    case = with_parameters(problem, random, parameters, values)
    experiment = Experiment(*case, simulation.method)
    (peaks,) = simulate([experiment], simulation, first, "critical_stress")
    rng = np.random.default_rng([simulation.seed, first, 1])
    return peaks + error * rng.standard_normal(peaks.size)
