"""Peaks of tests as a function of parameters, for other inference codes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from stiction._checks import (
    as_names,
    check_count,
    check_instance,
    is_finite,
    numbers,
)
from stiction.arrays import Array
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError
from stiction.inference.prior import full_key, with_parameters
from stiction.methods import Method, check_method, refusals
from stiction.model import describe
from stiction.problem import Problem
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, as_random_interface


@dataclass(frozen=True, eq=False)
class Simulator:
    """Peaks as a function of parameters; see `stiction.simulator`.

    Attributes
    ----------
    problem : Problem
    random : RandomInterface
    names : tuple of str
        The parameters, in order.
    method : Method
    samples, seed : int
    load_cell_error : float
        Pa.
    """

    problem: Problem
    random: RandomInterface
    names: tuple[str, ...]
    method: Any
    samples: int
    seed: int
    load_cell_error: float

    def _values(self, theta: Any) -> Array:
        if isinstance(theta, Mapping):
            if set(theta) != set(self.names):
                given = describe(list(theta))
                raise InputError(f"theta: must have the keys {', '.join(self.names)}, got {given}")
            theta = [theta[name] for name in self.names]
        values = numbers("theta", theta)
        if values.shape != (len(self.names),) or not np.isfinite(values).all():
            raise InputError(
                f"theta: must be {len(self.names)} finite numbers, {', '.join(self.names)}, got"
                f" {describe(theta)}"
            )
        return values

    def at(self, theta: Any) -> tuple[Problem, RandomInterface]:
        """The problem and what is random with these parameters."""
        return with_parameters(self.problem, self.random, self.names, self._values(theta))

    def __call__(self, theta: Any, *, first: int = 0) -> Array:
        """Peaks of tests at these parameters, Pa, (samples,).

        Parameters
        ----------
        theta : sequence or mapping of float
            In the order of `names`, or by name.
        first : int
            Number of the first sample: the same samples give a smooth function of theta, others
            an independent set of tests.

        Raises
        ------
        InputError
            If there is no problem with these parameters.
        """
        first = check_count("first", first, 0)
        problem, random = self.at(theta)
        if refused := refusals(problem, self.method):
            raise InputError(refused)
        experiment = Experiment(problem, random, self.method)
        parts = [
            experiment.results(self.seed, start, count)["critical_stress"]
            for start, count in experiment.batches(first, self.samples, max(256, experiment.batch))
        ]
        peaks: Array = np.concatenate(parts)
        if self.load_cell_error > 0.0:
            rng = np.random.default_rng([self.seed, first, 1])
            peaks = peaks + self.load_cell_error * rng.standard_normal(peaks.size)
        return peaks


def simulator(
    problem: Problem,
    random: RandomInterface | RandomField,
    parameters: Sequence[str],
    *,
    method: Method,
    samples: int,
    seed: int = 0,
    load_cell_error: float = 0.0,
) -> Simulator:
    """Peaks of repeated tests as a function of parameters, for dynesty, sbi and others.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random, with its known parameters.
    parameters : sequence of str
        Keys as in the prior of `infer`: ``("correlation_length", "marginal.low")``.
    method : LocalCriterion, Equilibrium or any other
    samples : int
        Tests that a call simulates.
    seed : int
        Not negative.
    load_cell_error : float
        Standard deviation of the error of a peak, Pa.

    Returns
    -------
    Simulator
        ``simulate(theta)`` gives the peaks, Pa, of shape (samples,); ``simulate(theta, first=k)``
        those of samples k, k + 1, ..., independent of the first ones if k >= samples.

    Raises
    ------
    InputError
        If a parameter does not exist, or another argument does not fit.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
    >>> keys = ("correlation_length", "marginal.low")
    >>> simulate = st.simulator(problem, strength, keys, method=st.LocalCriterion(), samples=25)
    >>> simulate([2e-3, 0.66e6]).shape
    (25,)
    """
    check_instance("problem", problem, Problem)
    check_method(method)
    names = as_names("parameters", parameters)
    samples, seed = check_count("samples", samples, 1), check_count("seed", seed, 0)
    if not (is_finite(load_cell_error) and load_cell_error >= 0.0):
        raise InputError(
            f"load_cell_error: must be a number >= 0 in Pa, got {describe(load_cell_error)}"
        )
    if not names or len({full_key(name) for name in names}) < len(names):
        raise InputError(f"parameters: must be different names, got {describe(list(names))}")
    interface = as_random_interface(random)
    return Simulator(problem, interface, names, method, samples, seed, float(load_cell_error))
