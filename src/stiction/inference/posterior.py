"""What the tests have told: draws, intervals, information gained, and how far to trust them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction._checks import is_finite, numbers
from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.density import to_v
from stiction.inference.likelihood import BATCHES, Likelihood, Model
from stiction.inference.peaks import Peaks
from stiction.model import describe
from stiction.problem import Problem
from stiction.random.random_interface import RandomInterface

if TYPE_CHECKING:
    pass

BINS = 40


@dataclass(frozen=True, eq=False)
class Posterior:
    """Parameters after the tests, beside what was thought of them before.

    Attributes
    ----------
    names : tuple of str
        The keys of the prior.
    draws : dict of arrays
        Draws of each parameter, (chains, draws), in its own unit.
    information : dict of float
        How much the tests told of each parameter alone: Kullback-Leibler divergence of its
        posterior from its prior, nats. 0 is nothing; ln 2 = 0.69 halves a uniform range.
    total_information : float
        The same of all parameters together; NaN by emcee, which does not tell.
    log_evidence : float
        Logarithm of the density of the peaks under the prior, for comparing models; NaN by emcee.
    monte_carlo_error : dict of float
        Standard error of the posterior mean that is due to the number of simulated samples, as a
        share of the standard deviation of the posterior.
    sampler : {"grid", "emcee"}
    method : str
        By what the onset was found.
    peaks : Peaks
        What was measured.
    notes : tuple of str
        What had to be said of the likelihood.
    diagnostics : dict
        Numbers that belong to the sampler.
    """

    names: tuple[str, ...]
    draws: Mapping[str, Array]
    information: Mapping[str, float]
    total_information: float
    log_evidence: float
    monte_carlo_error: Mapping[str, float]
    sampler: str
    method: str
    peaks: Peaks
    notes: tuple[str, ...]
    likelihood: Likelihood = field(repr=False)
    u: Array = field(repr=False)
    seed: int = 0
    diagnostics: Mapping[str, float] = field(default_factory=dict, repr=False)

    def _flat(self, name: str) -> Array:
        if name not in self.draws:
            raise InputError(f"name: must be one of {', '.join(self.names)}, got {describe(name)}")
        return self.draws[name].ravel()

    def mean(self, name: str) -> float:
        """Posterior mean of a parameter."""
        return float(self._flat(name).mean())

    def interval(self, name: str, confidence: float = 0.9) -> tuple[float, float]:
        """Central credible interval of a parameter.

        Parameters
        ----------
        name : str
        confidence : float
            Between 0 and 1.
        """
        if not (is_finite(confidence) and 0.0 < confidence < 1.0):
            raise InputError(f"confidence: must lie between 0 and 1, got {describe(confidence)}")
        tail = 0.5 * (1.0 - confidence)
        low, high = np.quantile(self._flat(name), [tail, 1.0 - tail])
        return float(low), float(high)

    def prior_interval(self, name: str, confidence: float = 0.9) -> tuple[float, float]:
        """The same of the prior."""
        self._flat(name)
        tail = 0.5 * (1.0 - confidence)
        prior = self.likelihood.model.prior
        ends = prior.theta(np.full((2, prior.dimension), [[tail], [1.0 - tail]]))
        low, high = ends[:, self.names.index(name)]
        return float(low), float(high)

    def at(self, draw: int) -> tuple[Problem, RandomInterface]:
        """Problem and what is random at one draw, to compute with: 0 to the number of draws - 1."""
        theta = np.array([self._flat(name)[draw] for name in self.names])
        return self.likelihood.model.prior.at(theta)

    def prior_transform(self, u: Any) -> Array:
        """Parameters at points u of the unit cube, in which the prior is uniform.

        Parameters
        ----------
        u : (parameters,) or (points, parameters) array
        """
        given = numbers("u", u)
        return self.likelihood.model.prior.theta(np.atleast_2d(given)).reshape(given.shape)

    def log_likelihood(self, theta: Any) -> Array | float:
        """Logarithm of the likelihood of all peaks.

        Parameters
        ----------
        theta : (parameters,) or (points, parameters) array
            In the order of `names`.

        Returns
        -------
        float or (points,) array
            -inf outside the prior.
        """
        given = numbers("theta", theta)
        wanted = len(self.names)
        if given.ndim not in (1, 2) or given.shape[-1] != wanted:
            raise InputError(
                f"theta: must have shape ({wanted},) or (points, {wanted}), got {given.shape}"
            )
        found = self.likelihood(self.likelihood.model.prior.u(np.atleast_2d(given)))
        return float(found[0]) if given.ndim == 1 else found

    @cached_property
    def predicted(self) -> tuple[Array, ...]:
        """Peaks that more tests would show, a draw each, for every kind of specimen."""
        model, u = self.likelihood.model, self.u.reshape(-1, self.u.shape[-1])
        return tuple(predicted(model, i, u, self.seed)[0] for i in range(len(model.specimens)))

    def to_arviz(self) -> Any:
        """An `arviz.InferenceData` with posterior, prior, log-likelihood, prediction and data.

        Raises
        ------
        InputError
            If ArviZ is not installed.
        """
        try:
            import arviz
        except ImportError:
            raise InputError(
                "to_arviz: needs the package arviz; pip install 'stiction[inference]'"
            ) from None
        chains, count = self.u.shape[:2]
        prior = self.likelihood.model.prior
        rng = np.random.default_rng(self.seed)
        before = prior.theta(rng.random((count, prior.dimension)))
        each = self.likelihood.each(self.u.reshape(-1, prior.dimension))
        measured = np.concatenate(self.peaks.values)
        name = "friction_coefficient" if self.peaks.coefficients else "peak"
        lengths = [
            np.full(values.size, np.nan if length is None else length)
            for length, values in zip(self.peaks.lengths, self.peaks.values, strict=True)
        ]
        more = [np.repeat(own.reshape(chains, count, 1), values.size, axis=2) for own, values in
                zip(self.predicted, self.peaks.values, strict=True)]  # fmt: skip
        return arviz.from_dict(
            posterior=dict(self.draws),
            prior={key: before[None, :, i] for i, key in enumerate(self.names)},
            log_likelihood={name: each.reshape(chains, count, measured.size)},
            posterior_predictive={name: np.concatenate(more, axis=2)},
            observed_data={name: measured},
            constant_data={"specimen_length": np.concatenate(lengths)},
            coords={"test": np.arange(measured.size)},
            dims={name: ["test"], "specimen_length": ["test"]},
            attrs={"sampler": self.sampler, "method": self.method},
        )

    def __str__(self) -> str:
        width = max(map(len, self.names))
        lines = [f"{self.peaks}; onset by {self.method}, posterior by {self.sampler}"]
        for name in self.names:
            low, high = self.interval(name)
            before = self.prior_interval(name)
            lines.append(
                f"  {name:{width}s}  mean {self.mean(name):.4g}, 90 % {low:.4g} to {high:.4g}"
                f" (prior {before[0]:.4g} to {before[1]:.4g}), {self.information[name]:.2f} nats"
            )
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)


def predicted(model: Model, number: int, u: Array, seed: int) -> tuple[Array, Array]:
    """A peak and a position of specimen `number` at each of some points u (points, parameters)."""
    rng = np.random.default_rng([seed, 1])
    theta = model.prior.theta(u)
    shift, stretch = model.affine.of(theta)
    rows = np.arange(u.shape[0])
    table, known = model.specimens[number].table, model.specimens[number].densities
    index, weight = table.corners(theta)
    cell = (weight.cumsum(axis=1) < rng.random((u.shape[0], 1))).sum(axis=1)
    node = index[rows, np.minimum(cell, index.shape[1] - 1)]
    sample = rng.integers(table.peaks.shape[1], size=u.shape[0])
    v = to_v(table.peaks, known.bound)[node, sample]
    z = (v - known.mean[node]) / known.spread[node]

    def between(values: Array) -> Array:
        found: Array = np.einsum("pc,pc->p", weight, values[index])
        return found

    onset = between(known.mean) + between(known.spread) * z
    if np.isfinite(known.bound).all():
        onset = between(known.bound) + np.exp(onset)
    peaks = shift + stretch * onset + model.error * rng.standard_normal(u.shape[0])
    return peaks, table.places[node, sample]


def monte_carlo_errors(likelihood: Likelihood, u: Array) -> Array:
    """Standard error of the posterior means over their standard deviations, (parameters,).

    Jackknife over batches of the simulated samples: the posterior without each is the one at hand,
    weighted.
    """
    whole = likelihood.of_peaks(u)
    theta = likelihood.model.prior.theta(u)
    means = []
    for batch in range(BATCHES):
        change = likelihood.of_peaks(u, without=batch) - whole
        weight = np.exp(change - change.max())
        means.append(weight @ theta / weight.sum())
    spread = np.array(means) - np.mean(means, axis=0)
    error = np.sqrt((BATCHES - 1) / BATCHES * np.sum(spread**2, axis=0))
    result: Array = error / np.maximum(theta.std(axis=0), 1e-300)
    return result
