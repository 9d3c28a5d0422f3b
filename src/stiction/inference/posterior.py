"""The posterior: draws, intervals, information gained, and how accurate they are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.density import to_v
from stiction.inference.likelihood import BATCHES, Likelihood, Model
from stiction.inference.onset_table import corners
from stiction.inference.peaks import Peaks
from stiction.inference.prior import Prior
from stiction.model import Numbers, check, describe
from stiction.problem import Problem
from stiction.random.random_interface import RandomInterface


@dataclass(frozen=True, eq=False, kw_only=True)
class Posterior:
    """Posterior of the parameters, together with their prior.

    Attributes
    ----------
    names : tuple of str
        The keys of the prior.
    draws : dict of (draws,) arrays
        Draws of each parameter, in its own unit.
    information : dict of float
        Kullback-Leibler divergence of the posterior of each parameter alone from its prior,
        nats. Halving a uniform range gives ln 2 = 0.69.
    total_information : float
        The same for all parameters together.
    log_evidence : float
        Logarithm of the density of the peaks under the prior, for comparing models.
    monte_carlo_error : dict of float
        Standard error of the posterior mean that is due to the number of simulated samples, as a
        share of the standard deviation of the posterior.
    method : str
        Method that found the onset.
    peaks : Peaks
        The measured peaks.
    notes : tuple of str
        Limitations of the result.
    """

    peaks: Peaks
    draws: Mapping[str, Array]
    information: Mapping[str, float]
    total_information: float
    log_evidence: float
    monte_carlo_error: Mapping[str, float]
    notes: tuple[str, ...]
    likelihood: Likelihood = field(repr=False)
    u: Array = field(repr=False)
    seed: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """The keys of the prior."""
        return tuple(self.draws)

    @property
    def method(self) -> str:
        """Method that found the onset."""
        return str(self.likelihood.model.method.label)

    @property
    def prior(self) -> Prior:
        """The prior: `theta(u)` and `u(theta)` map the unit cube to the parameters and back."""
        return self.likelihood.model.prior

    def mean(self, name: str) -> float:
        """Return the posterior mean of a parameter."""
        return float(self.draws[name].mean())

    def interval(self, name: str, confidence: float = 0.9) -> tuple[float, float]:
        """Return the central credible interval of a parameter.

        Parameters
        ----------
        name : str
        confidence : float
            Between 0 and 1.
        """
        if not 0.0 < confidence < 1.0:
            raise InputError(
                f"confidence: must lie between 0 and 1, got {describe(confidence)}"
            )
        tail = 0.5 - 0.5 * confidence
        low, high = np.quantile(self.draws[name], [tail, 1.0 - tail])
        return float(low), float(high)

    def at(self, draw: int) -> tuple[Problem, RandomInterface]:
        """Return the problem and what is random at one draw, to compute with."""
        return self.prior.at(np.array([own[draw] for own in self.draws.values()]))

    def prior_transform(self, u: Any) -> Array:
        """Return the parameters at points u of the unit cube, in which the prior is uniform.

        Parameters
        ----------
        u : (parameters,) or (points, parameters) array
        """
        given = self._points("u", u)
        return self.prior.theta(np.atleast_2d(given)).reshape(given.shape)

    def log_likelihood(self, theta: Any) -> Array | float:
        """Return the logarithm of the likelihood of all peaks.

        Parameters
        ----------
        theta : (parameters,) or (points, parameters) array
            In the order of `names`.

        Returns
        -------
        float or (points,) array
            -inf outside the prior.
        """
        given = self._points("theta", theta)
        found = self.likelihood(self.prior.u(np.atleast_2d(given)))
        return float(found[0]) if given.ndim == 1 else found

    def _points(self, name: str, given: Any) -> Array:
        points: Array = check(name, given, Numbers)
        wanted = len(self.names)
        if points.ndim not in (1, 2) or points.shape[-1] != wanted:
            raise InputError(
                f"{name}: must have shape ({wanted},) or (points, {wanted}), got {points.shape}"
            )
        return points

    @cached_property
    def predicted(self) -> tuple[Array, ...]:
        """Peaks of further tests, one for each draw, for every kind of specimen."""
        model = self.likelihood.model
        return tuple(
            predicted(model, i, self.u, self.seed) for i in range(len(model.specimens))
        )

    def to_arviz(self) -> Any:
        """Return an `arviz.InferenceData`: posterior, prior, log-likelihood, prediction, data.

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
        before = self.prior.theta(np.random.default_rng(self.seed).random(self.u.shape))
        measured = np.concatenate(self.peaks.values)
        sizes = [own.size for own in self.peaks.values]
        predicted = np.repeat(np.stack(self.predicted, axis=1), sizes, axis=1)
        name = "friction_coefficient" if self.peaks.coefficients else "peak"
        return arviz.from_dict(
            posterior={key: own[None] for key, own in self.draws.items()},
            prior={key: before[None, :, i] for i, key in enumerate(self.names)},
            log_likelihood={name: np.concatenate(self.likelihood.parts(self.u), axis=1)[None]},
            posterior_predictive={name: predicted[None]},
            observed_data={name: measured},
            coords={"test": np.arange(measured.size)},
            dims={name: ["test"]},
        )

    def __str__(self) -> str:
        width = max(map(len, self.names))
        lines = [f"{self.peaks}; onset by {self.method}"]
        prior = self.prior.theta(np.repeat([[0.05], [0.95]], len(self.names), axis=1)).T
        for name, before in zip(self.names, prior, strict=True):
            low, high = self.interval(name)
            lines.append(
                f"  {name:{width}s}  mean {self.mean(name):.4g}, 90 % {low:.4g} to {high:.4g}"
                f" (prior {before[0]:.4g} to {before[1]:.4g}), {self.information[name]:.2f} nats"
            )
        lines += [f"  {note}" for note in self.notes]
        return "\n".join(lines)


def predicted(model: Model, number: int, u: Array, seed: int) -> Array:
    """Draw a peak of specimen `number` at each of some points u (points, parameters)."""
    rng = np.random.default_rng([seed, 1])
    theta = model.prior.theta(u)
    shift, stretch = model.scaling.of(theta)
    own, rows = model.specimens[number], np.arange(u.shape[0])
    known = own.densities
    index, weight = corners(model.axes, theta)
    corner = (weight.cumsum(axis=1) < rng.random((u.shape[0], 1))).sum(axis=1)
    node = index[rows, np.minimum(corner, index.shape[1] - 1)]
    sample = rng.integers(own.peaks.shape[1], size=u.shape[0])
    z = (to_v(own.peaks, known.bound)[node, sample] - known.mean[node]) / known.spread[node]

    def between(values: Array) -> Array:
        found: Array = np.einsum("pc,pc->p", weight, values[index])
        return found

    onset = between(known.mean) + between(known.spread) * z
    if np.isfinite(known.bound).all():
        onset = between(known.bound) + np.exp(onset)
    found: Array = shift + stretch * onset + model.error * rng.standard_normal(u.shape[0])
    return found


def monte_carlo_errors(likelihood: Likelihood, u: Array) -> Array:
    """Return standard errors of the posterior means over their standard deviations, (parameters,).

    Jackknife over batches of the simulated samples: the posterior without each is the one at hand,
    weighted.
    """
    whole = likelihood(u)
    theta = likelihood.model.prior.theta(u)
    means = []
    for batch in range(BATCHES):
        parts = likelihood.without(batch).parts(u)
        change = sum(part.sum(axis=1) for part in parts) - whole
        weight = np.exp(change - change.max())
        means.append(weight @ theta / weight.sum())
    spread = np.array(means) - np.mean(means, axis=0)
    error = np.sqrt((BATCHES - 1) / BATCHES * np.sum(spread**2, axis=0))
    result: Array = error / np.maximum(theta.std(axis=0), 1e-300)
    return result
