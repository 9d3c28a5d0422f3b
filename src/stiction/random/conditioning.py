"""A field that is known in part: measured values with errors, and what they tell of the rest.

A Gaussian field on an interface is a linear function of its draws a, z(x) = phi(x)^T a, with a
standard normal. So measured z_k = phi(x_k)^T a + e_k are a linear regression, whose posterior is

    a | z ~ N(mu, P),  P = (1 + Psi^T Psi)^-1,  mu = P Psi^T (z_k/error_k),  Psi = phi(x_k)/error_k,

and mu + P^(1/2) a with the symmetric root turns the usual draws into conditioned ones, without
others. It is the same distribution as by Matheron's rule (Journel and Huijbregts, 1978; Doucet,
2010). With the singular values of Psi = U s V^T, P^(1/2) = 1 + V ((1 + s^2)^(-1/2) - 1) V^T is well
conditioned however densely a smooth field was measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
import pydantic
import xarray as xr
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema
from scipy.linalg import svd
from scipy.special import ndtri

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.jit import jit
from stiction.model import PROFILE_SCHEMA, Positive, check_memory, model, real_array
from stiction.random.mapping import quantile_of_normal
from stiction.random.modes import Modes

NEGLIGIBLE = 1e-8
"""Singular values below which a direction of the draws stays as it is, to round-off."""
DOUBTFUL = 5.0
"""Standard deviations of chi-square beyond which measured values do not suit a field."""
IMPOSSIBLE = 4.0
"""Errors beyond a bound of the marginal that no measured value has."""
NODES, PASSES = 65, 4
"""Of the posterior of the factor between specimens, and how often its range is narrowed."""
CURVED, OFTEN = 0.25, 0.05
"""Curvature of the map over an error, relative to it, and a share of values: worth a warning."""


def _points(value: Any, info: pydantic.ValidationInfo) -> Array:
    """Places (rows x, and y on a plane) and values (last row) of what was measured."""
    read = (info.context or {}).get("read")
    if read is not None and not isinstance(value, xr.DataArray):
        value = read(value, "strength")
    if isinstance(value, dict) and "dims" in value:
        value = xr.DataArray.from_dict(value)
    if isinstance(value, dict) and "values" in value:
        rows = [np.ravel(value[name]) for name in ("x", "y", "values") if name in value]
    else:
        dims = getattr(value, "dims", None)
        if dims not in (("x",), ("x", "y"), ("y", "x")) or any(d not in value.coords for d in dims):
            raise ValueError(
                "must be a DataArray over x (m), on a plane over x and y, with coordinates, as"
                " st.read_profile(path) returns it"
            )
        names = sorted(dims)
        value = value.transpose(*names)
        places = np.meshgrid(*(value[name].values for name in names), indexing="ij")
        rows = [np.ravel(each) for each in (*places, value.values)]
    points = np.array(rows, dtype=np.float64)
    points = points[:, np.isfinite(points).all(axis=0)]
    if points.ndim != 2 or points.shape[1] == 0:
        raise ValueError("must hold at least one value")
    points.flags.writeable = False
    return points


def _table(points: Array) -> dict[str, list[float]]:
    names = ("x", "y", "values") if points.shape[0] == 3 else ("x", "values")
    return {name: row.tolist() for name, row in zip(names, points, strict=True)}


Points = Annotated[
    Any,
    BeforeValidator(_points),
    PlainSerializer(_table),
    WithJsonSchema({"anyOf": PROFILE_SCHEMA}),
]


@model
class Conditions:
    """What was measured of a field; see `RandomField.given`.

    Parameters
    ----------
    profile : DataArray over x (m), on a plane over x and y
        Measured values, in the unit of the field; NaN where nothing was measured.
    noise : float
        Standard deviation of the error of a value, in the same unit, positive.
    """

    profile: Points
    noise: Positive

    @property
    def places(self) -> Array:
        """Where values were measured, m: (dimensions, points)."""
        return self.profile[:-1]

    @property
    def values(self) -> Array:
        """The measured values, (points,)."""
        return self.profile[-1]

    def normal(self, marginal: Any, factors: Array | None = None) -> tuple[Array, Array, Array]:
        """Return measured values of z and their errors, to first order, (factors, points) each.

        `factors`, of which there is one by default, multiply the marginal. Values within an error
        of a bound, or beyond, are taken as one error inside; the third array, (factors,), is the
        sum of the squares of these moves, over the errors.
        """
        law = marginal.distribution
        low, high = law.support()
        factors = np.ones((1, 1)) if factors is None else factors[:, None]
        noise, given = self.noise / factors, self.values / factors
        edge = np.minimum(noise, 0.25 * (high - low))
        value = np.clip(given, low + edge, high - edge)
        below = law.cdf(value)
        z = np.where(below < 0.5, ndtri(below), -ndtri(law.sf(value)))
        slope = np.exp(-0.5 * z * z) / np.sqrt(2.0 * np.pi) / law.pdf(value)
        return z, noise / slope, (((value - given) / noise) ** 2).sum(axis=1)

    def check(self, marginal: Any, interface: Interface, factor: Any = None) -> None:
        """Raise an `InputError` if places or values are impossible for a field."""
        if len(self.places) != len(interface.shape):
            raise InputError("given.profile: " + _OTHER_DIMENSION[interface.is_plane])
        problems = [
            f"given.profile: {name} reaches from {row.min():g} to {row.max():g} m, the interface is"
            f" {length:g} m long"
            for name, row, length in zip("xy", self.places, interface.lengths, strict=False)
            if row.min() < -1e-9 * length or row.max() > length * (1.0 + 1e-9)
        ]
        low, high = marginal.distribution.support()
        away = np.maximum(low - self.values, self.values - high)
        if factor is None and away.max() > IMPOSSIBLE * self.noise:
            worst, names = int(away.argmax()), "xy"[: len(self.places)]
            at = ", ".join(
                f"{name} = {row[worst]:g} m" for name, row in zip(names, self.places, strict=True)
            )
            problems.append(
                f"given.profile: {self.values[worst]:g} at {at} lies outside the marginal, which"
                f" reaches from {low:g} to {high:g}, by more than {IMPOSSIBLE:g} times its error of"
                f" {self.noise:g}"
            )
        if problems:
            raise InputError(problems)

    def warn(self, marginal: Any) -> None:
        """Warn of values near a bound, and where the error is not small against the map's bend."""
        low, high = marginal.distribution.support()
        near = (self.values < low + self.noise) | (self.values > high - self.noise)
        if near.any():
            warn_accuracy(
                f"given.profile: {near.sum()} of {near.size} values lie within an error of a bound"
                f" of the marginal ({low:g} to {high:g}), or beyond, and are taken as one error"
                " inside"
            )
        z, error, _ = self.normal(marginal)
        ends = [quantile_of_normal(marginal.distribution, z + shift) for shift in (-error, error)]
        middle = quantile_of_normal(marginal.distribution, z)
        bend = np.abs(ends[0] + ends[1] - 2.0 * middle) / (2.0 * self.noise)
        if np.mean(bend > CURVED) > OFTEN:
            warn_accuracy(
                f"given.noise: over {self.noise:g} the map from the Gaussian field to the marginal"
                f" bends at {100.0 * np.mean(bend > CURVED):.0f} % of the values, and errors are"
                " taken to first order"
            )


_OTHER_DIMENSION = {
    True: "was measured along a line, and the interface is a plane: give its y, too",
    False: "was measured on a plane, and the interface is a line",
}


def basis(modes: Modes, mean_mode: bool, lengths: Sequence[float], places: Array) -> Array:
    """Return phi, (points, dimension): z at places (dimensions, points) is phi @ draws."""
    phase = 2.0 * np.pi * (places / np.array(lengths)[:, None]).T @ modes.numbers[:, 1:]
    phi = np.empty((phase.shape[0], modes.dimension))
    start = int(mean_mode)
    phi[:, :start] = modes.sigma[0]
    phi[:, start::2] = modes.sigma[1:] * np.cos(phase)
    phi[:, start + 1 :: 2] = modes.sigma[1:] * np.sin(phase)
    return phi


class Measured(NamedTuple):
    """What was measured of one property.

    Attributes
    ----------
    conditions : Conditions
    marginal : Beta or any other marginal
    phi : (points, dimension) array
        z at its places is phi @ draws.
    factor : marginal or None
        Of the factor between specimens, by whose draw the marginal is multiplied.
    """

    conditions: Conditions
    marginal: Any
    phi: Array
    factor: Any = None

    def normal(self, u: Array) -> tuple[Array, Array, Array]:
        """Return measured z and their errors for draws u of the factor between specimens."""
        factors = np.ones(u.size)
        if self.factor is not None:
            factors = quantile_of_normal(self.factor.distribution, u)
        return self.conditions.normal(self.marginal, factors)


class Conditioning:
    """Standard normal draws, given what was measured.

    Parameters
    ----------
    measured : sequence of Measured
        Of one or several properties; at most one has a factor between specimens.

    Notes
    -----
    A factor b(u) between specimens is part of what is measured: z depend on its draw u, and the
    probability of the values is, but for a constant,

        log p(values | u) = -chi^2(u)/(2 rho^2) - sum log(1 + (s/rho)^2)/2,

    with rho the geometric mean of the errors at u over those at the mean of u, for which the
    regression is made. The draw of u is mapped to its posterior, quantile by quantile.
    """

    def __init__(self, measured: Sequence[Measured]) -> None:
        self.measured = measured
        self.grid: Array | None = None
        self._regress(np.zeros(1))
        if all(one.factor is None for one in measured):
            return
        middle, spread = 0.0, 1.0
        for _ in range(PASSES):
            grid = np.clip(middle + spread * np.linspace(-8.0, 8.0, NODES), -37.0, 37.0)
            self._regress(grid)
            weight = self._posterior_weights(grid)
            middle = float(weight @ grid)
            spread = max(float(weight @ (grid - middle) ** 2) ** 0.5, 8.0 * spread / NODES)
        mass = 0.5 * (weight[1:] + weight[:-1])
        below, above = np.cumsum(mass)[:-1], np.cumsum(mass[::-1])[-2::-1]
        score = np.where(below < 0.5, ndtri(below), -ndtri(above))
        usable = np.isfinite(score)
        self.grid, self.score, self.quantile = grid, score[usable], grid[1:-1][usable]

    def _regress(self, grid: Array) -> None:
        """Regress on the values at the middle of a grid of u, and reduce those at all of it."""
        parts = [one.normal(grid) for one in self.measured]
        z, error = (np.concatenate([part[i] for part in parts], axis=1) for i in (0, 1))
        own = error[grid.size // 2]
        phi = np.concatenate([one.phi for one in self.measured])
        check_memory("given.profile", 24.0 * phi.size, "give fewer places")
        left, values, right = svd(phi / own[:, None], full_matrices=False)
        kept = values > NEGLIGIBLE
        self.values, self.right = values[kept], np.ascontiguousarray(right[kept].T)
        self.data = (z / own) @ left[:, kept]  # (nodes of u, r)
        self.total, self.moved = ((z / own) ** 2).sum(axis=1), sum(part[2] for part in parts)
        self.ratio = np.exp(np.log(error / own).mean(axis=1))
        self.points = own.size

    def chi_square(self) -> Array:
        """Return chi^2 at each u of the grid; as many as values, if they suit the field."""
        power = (self.values / self.ratio[:, None]) ** 2
        found: Array = self.total - (power / (1.0 + power) * self.data**2).sum(axis=1)
        return found / self.ratio**2 + self.moved

    def _posterior_weights(self, grid: Array) -> Array:
        volume = np.log1p((self.values / self.ratio[:, None]) ** 2).sum(axis=1)
        density = -0.5 * (grid**2 + self.chi_square() + volume)
        weight = np.exp(density - density.max())
        return weight / float(weight.sum())

    def specimen(self, u: Array) -> Array:
        """Return the draws of the factor between specimens, conditioned."""
        if self.grid is None:
            return u
        found: Array = np.interp(u, self.score, self.quantile)
        return found

    def draws(self, draws: Array, u: Array | None = None) -> Array:
        """Return conditioned draws of the fields, (samples, dimension), with u from `specimen`."""
        data = self.data
        if u is not None and self.grid is not None:
            data = np.stack([np.interp(u, self.grid, row) for row in self.data.T], axis=1)
        gain = self.values / (1.0 + self.values**2)
        out = np.array(draws)
        narrow = (1.0 + self.values**2) ** -0.5 - 1.0
        transposed = np.ascontiguousarray(self.right.T)
        _condition(self.right, transposed, np.ascontiguousarray(data * gain), narrow, out)
        return out

    def moments(self, phi: Array) -> tuple[Array, Array]:
        """Return mean and standard deviation of z = phi @ draws, (points,) each."""
        along = phi @ self.right
        share = self.values**2 / (1.0 + self.values**2)
        variance = (phi**2).sum(axis=1) - along**2 @ share
        return along @ (share / self.values * self.data[0]), np.sqrt(np.maximum(variance, 0.0))

    def warn(self) -> None:
        """Warn of measured values that do not suit the field."""
        for one in self.measured:
            one.conditions.warn(one.marginal)
        chi_square, points = float(self.chi_square().min()), self.points
        if chi_square > points + DOUBTFUL * np.sqrt(2.0 * points):
            warn_accuracy(
                f"given: the measured values are unlikely for this field (chi-square"
                f" {chi_square:.4g} for {points} values): check its marginal, its correlation"
                " length and the noise"
            )


@jit
def _condition(right: Array, transposed: Array, offsets: Array, factors: Array, out: Array) -> None:
    """Replace each row a of `out` by a + V (offset + factors V^T a), in an order of its own."""
    dimension, count = right.shape
    weights = np.empty(count)
    for i in range(out.shape[0]):
        weights[:] = 0.0
        for j in range(dimension):
            draw = out[i, j]
            for k in range(count):
                weights[k] += draw * right[j, k]
        row = min(i, offsets.shape[0] - 1)
        for k in range(count):
            weight = offsets[row, k] + factors[k] * weights[k]
            for j in range(dimension):
                out[i, j] += weight * transposed[k, j]
