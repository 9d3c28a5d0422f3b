"""Importance sampling around the most likely weak spot, put at a random place on the interface.

Where the problem looks the same everywhere there is one most likely failure for each place, so the
sampling density is a mixture of normal densities shifted by the same dip at all nodes. Its weights
are sums over the nodes, taken as logarithms: in hundreds of dimensions densities underflow. On a
plane the dip is that of the middle one of the critical ellipses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

import stiction as st
from stiction.arrays import Array
from stiction.criterion.windows import windows_of
from stiction.random.mapping import from_normal
from stiction.random.random_field import RandomField

SIZES = (1.0, 1.15)
"""Shifts in units of the design point: the failures lie a little beyond it."""
ITERATIONS = 200
AT_ONCE = 1 << 22
"""Nodes of all samples whose weights are summed at once."""


@dataclass(frozen=True, eq=False)
class DesignPoint:
    """The most likely draws at which a given place becomes unstable at a given stress.

    Attributes
    ----------
    draws : (dimension,) array
    index : float
        beta, their distance from the origin.
    converged : bool
    """

    draws: Array
    index: float
    converged: bool


def _slope(field: RandomField, z: Array) -> Array:
    h = 1e-4
    difference: Array = from_normal(field.marginal, z + h) - from_normal(field.marginal, z - h)
    return difference / (2.0 * h)


def _draws_of(field: RandomField, problem: st.Problem, nodal: Array) -> Array:
    """Draws u = A^T w, where z = A u is the field of draws u at the nodes."""
    modes = field.modes(problem.interface)
    spectrum = np.fft.fftn(nodal)
    numbers = modes.numbers[:, 1:] % np.array(nodal.shape)[:, None]
    waves = modes.sigma[1:] * spectrum[tuple(numbers)]
    start = int(field.mean_mode)
    draws = np.zeros(modes.dimension)
    draws[start::2], draws[start + 1 :: 2] = waves.real, -waves.imag
    if field.mean_mode:
        draws[0] = modes.sigma[0] * spectrum.flat[0].real
    return draws


def design_point(problem: st.Problem, field: RandomField, excess: float) -> DesignPoint:
    """Most likely draws whose nucleation stress at the first node is as low as given.

    Parameters
    ----------
    problem : Problem
        Uniform along the interface.
    field : RandomField
        Peak strength.
    excess : float
        Average of the strength over the critical patch at which it becomes unstable, Pa.

    Notes
    -----
    The nearest point to the origin on <g, F^-1(Phi(z))> = excess, by the iteration of Rackwitz and
    Fiessler (1978), with the step halved as long as the merit |u|^2/2 + c |miss| of Zhang and
    Der Kiureghian (1995) does not fall. The gradient is the criterion's weight g times the slope
    of the map.
    """
    weight = _critical_weight(problem)
    draws = np.zeros(field.modes(problem.interface).dimension)

    def miss(u: Array) -> tuple[float, Array]:
        z = field.gaussian(problem.interface, u[None])[0]
        strength: Array = from_normal(field.marginal, z)
        return float(weight.ravel() @ strength.ravel()) - excess, z

    height, z = miss(draws)
    scale = abs(height) if height != 0.0 else 1.0
    converged = False
    for _ in range(ITERATIONS):
        slope = _draws_of(field, problem, weight * _slope(field, z))
        steepness = float(slope @ slope)
        if not steepness > 0.0:
            break
        target = slope * ((float(slope @ draws) - height) / steepness)
        if np.linalg.norm(target - draws) < 1e-3 and abs(height) < 1e-6 * scale:
            converged = True
            break
        penalty = 2.0 * np.linalg.norm(target) / np.sqrt(steepness) + 1e-30

        def merit(u: Array, value: float, penalty: float = float(penalty)) -> float:
            return 0.5 * float(u @ u) + penalty * abs(value)

        now, length = merit(draws, height), 1.0
        for _ in range(12):
            trial = draws + length * (target - draws)
            trial_height, trial_z = miss(trial)
            if merit(trial, trial_height) < now:
                break
            length *= 0.5
        draws, height, z = trial, trial_height, trial_z
    return DesignPoint(draws, float(np.linalg.norm(draws)), converged)


def _critical_weight(problem: st.Problem) -> Array:
    """Weight of the critical patch around the first node, (*shape)."""
    windows = windows_of(problem, float(np.max(np.asarray(problem.friction.weakening_rate))))
    return windows[len(windows) // 2].weight


@dataclass(frozen=True, eq=False)
class Mixture:
    """Normal densities shifted by one dip, at every node and in several sizes, equally likely.

    Attributes
    ----------
    shift : (dimension,) array
        Draws of the dip at the first node.
    shape : tuple of int
        Nodes in each direction.
    numbers : (dimensions, modes) array of int
        Wave vectors in units of 2 pi/length, without the mean.
    mean_mode : bool
        Whether the first draw belongs to the mean.
    sizes : tuple of float
    """

    shift: Array
    shape: tuple[int, ...]
    numbers: NDArray[np.int64]
    mean_mode: bool = False
    sizes: tuple[float, ...] = SIZES

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return math.prod(self.shape)

    def _waves(self, draws: Array) -> NDArray[np.complex128]:
        start = int(self.mean_mode)
        waves: NDArray[np.complex128] = draws[..., start::2] - 1j * draws[..., start + 1 :: 2]
        return waves

    def moved(self, node: NDArray[np.int64]) -> Array:
        """The shift with its dip at given nodes, shape (len(node), dimension)."""
        place = np.unravel_index(node, self.shape)
        phase = sum(
            2.0 * np.pi * ((at[:, None] * j) % n) / n
            for at, j, n in zip(place, self.numbers, self.shape, strict=True)
        )
        turned = self._waves(self.shift) * np.exp(-1j * np.asarray(phase))
        start = int(self.mean_mode)
        draws = np.empty((node.size, self.shift.size))
        draws[:, start::2], draws[:, start + 1 :: 2] = turned.real, -turned.imag
        if start:
            draws[:, 0] = self.shift[0]
        return draws

    def sample(self, samples: int, rng: np.random.Generator) -> Array:
        """Draws of the mixture, shape (samples, dimension)."""
        draws = rng.standard_normal((samples, self.shift.size))
        node = rng.integers(0, self.nodes, samples)
        size = np.asarray(self.sizes)[rng.integers(0, len(self.sizes), samples)]
        draws += size[:, None] * self.moved(node)
        return draws

    def projections(self, draws: Array) -> Array:
        """Product of each sample with the shift at each node, shape (samples, nodes)."""
        product = self._waves(draws) * np.conj(self._waves(self.shift))
        spectrum = np.zeros((draws.shape[0], self.nodes), dtype=np.complex128)
        modes = np.ravel_multi_index(list(self.numbers), self.shape, mode="wrap")
        for column, mode in zip(product.T, modes, strict=True):
            spectrum[:, mode] += column
        axes = tuple(range(1, 1 + len(self.shape)))
        waves = spectrum.reshape(-1, *self.shape)
        found: Array = np.fft.ifftn(waves, axes=axes).real.reshape(spectrum.shape) * self.nodes
        if self.mean_mode:
            found += (draws[:, 0] * self.shift[0])[:, None]
        return found

    def log_weights(self, draws: Array) -> Array:
        """Logarithm of the normal density over the mixture's, shape (samples,)."""
        some = max(1, AT_ONCE // self.nodes)
        parts = [self._log_weights(draws[i : i + some]) for i in range(0, len(draws), some)]
        return np.concatenate(parts) if parts else np.zeros(0)

    def _log_weights(self, draws: Array) -> Array:
        projected = self.projections(draws)
        square = float(self.shift @ self.shift)
        parts = [logsumexp(a * projected, axis=1) - 0.5 * a * a * square for a in self.sizes]
        mixture: Array = logsumexp(np.stack(parts), axis=0) - np.log(
            self.nodes * len(self.sizes)
        )
        return -mixture


@dataclass(frozen=True)
class Answer:
    """Probability, its coefficient of variation, and how many equal weights it is worth."""

    probability: float
    cv: float
    effective_size: float


def by_importance(
    problem: st.Problem,
    field: RandomField,
    stress: float,
    method: st.LocalCriterion,
    cv: float,
    *,
    seed: int = 0,
    event: str = "critical_stress",
) -> Answer:
    """P(onset < stress) by sampling around the most likely weak spot, until `cv` is reached."""
    point = design_point(problem, field, stress)
    assert point.converged
    modes = field.modes(problem.interface)
    mixture = Mixture(
        point.draws, problem.interface.shape, modes.numbers[:, 1:], field.mean_mode
    )
    state = st.external.limit_state(problem, field, method, event=event)
    rng = np.random.default_rng((seed, 4))
    weights = np.empty(0)
    while True:
        draws = mixture.sample(1000, rng)
        failed = state(draws) < stress
        new = np.where(failed, np.exp(mixture.log_weights(draws)), 0.0)
        weights = np.append(weights, new)
        mean, error = weights.mean(), weights.std() / math.sqrt(weights.size)
        if mean > 0.0 and error <= cv * mean:
            size = weights.sum() ** 2 / np.sum(weights * weights)
            return Answer(float(mean), float(error / mean), float(size))
