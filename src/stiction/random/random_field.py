"""The random field: a Gaussian field of given spectrum, mapped to a given marginal."""

from __future__ import annotations

import dataclasses
import math
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field
from scipy.optimize import brentq
from scipy.special import ndtri

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.interface import Interface
from stiction.model import Flag, Number, Numbers, Positive, check_memory, checked, model
from stiction.random.conditioning import Conditioning, Conditions, Measured
from stiction.random.mapping import correlation_of_mapped, from_normal, hermite_coefficients
from stiction.random.marginals import AnyMarginal
from stiction.random.modes import Modes, make_modes
from stiction.random.spectra import Share, Spectrum, lag_of_correlation
from stiction.random.synthesis import Stream, block_of

# Limits of warnings: shares of the variance that the grid or the mean mode would hold, and the
# error of a correlation.
LOST, WITHOUT_MEAN, UNCERTAIN = 1e-4, 0.075, 0.01


@model
class RandomField:
    """Stationary, periodic, non-Gaussian random field F^-1(Phi(z(x))).

    Parameters
    ----------
    marginal : Beta, ..., or frozen continuous scipy.stats distribution
        Distribution F of the field at a point.
    spectrum : PowerLawSpectrum, ..., CustomSpectrum
        Power spectral density of the Gaussian field z.
    mean_mode : bool
        Whether z has the mode k = 0. Without it, as in Albertini et al. (2020), every
        sample has the same mean of z, which is harmless only if the correlation length is
        short compared with the interface.
    anisotropy : float, optional
        On a plane, the correlation length along y over that along x, which is that of the
        spectrum; 1 if left out.
    of : {"friction_coefficient"}, optional
        The field holds friction coefficients. The strength (or the other stress that the
        field represents) is their product with the normal pressure.
    conditions : Conditions, optional
        Measured values, as set by `given`; in a study file the table ``given``.

    Notes
    -----
    On a plane, a line along x has the correlation of the field on a line, except that
    truncation removes slightly more power. Translation process after Grigoriu (1995), spectral
    representation after Shinozuka and Deodatis (1991); Albertini et al. (2020), Eqs. 2 to 7.

    Examples
    --------
    >>> import stiction as st
    >>> field = st.RandomField(
    ...     marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    ...     spectrum=st.PowerLawSpectrum(correlation_length=2e-3),
    ... )
    >>> field.sample(st.Interface(length=0.1, nodes=512), samples=3, seed=1).shape
    (3, 512)
    """

    marginal: AnyMarginal
    spectrum: Spectrum
    mean_mode: Flag = False
    anisotropy: Positive | None = None
    of: Literal["friction_coefficient"] | None = None
    conditions: Annotated[Conditions | None, Field(alias="given")] = None

    @property
    def mean(self) -> float:
        """Mean of the field, in its own unit (Pa for strength)."""
        return float(self.marginal.distribution.mean())

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the field, in its own unit."""
        return float(self.marginal.distribution.std())

    @checked
    def modes(self, interface: Interface) -> Modes:
        """Return the modes of this field on an interface; an `InputError` if there are none."""
        if self.anisotropy is not None and not interface.is_plane:
            raise InputError(
                "anisotropy: is a ratio of correlation lengths along y and x, and a line has no y;"
                f" got {self.anisotropy:g}, leave it out"
            )
        return make_modes(self.spectrum, self.mean_mode, self.anisotropy or 1.0, interface)

    @checked
    def draws(
        self, interface: Interface, samples: Number, seed: Number, first: Number = 0
    ) -> Array:
        """Draw the standard normal numbers of samples `first`, `first` + 1, ....

        Draw j of sample i depends on (seed, i, j) only, not on the batch or spectrum. Returned
        are (samples, dimension): A_1, B_1, A_2, B_2, ..., with A_0 in front if `mean_mode`.
        """
        modes = self.modes(interface)
        check_memory("samples", 8.0 * min(samples, 2**62) * (modes.dimension + interface.size))
        block = block_of(len(interface.shape))
        return Stream(0, block, modes.ranks, self.mean_mode).draw(seed, first, samples)

    @checked
    def gaussian(self, interface: Interface, draws: Numbers) -> Array:
        """Compute the Gaussian field z of given draws, (samples, *shape), of unit variance."""
        modes = self.modes(interface)
        if draws.ndim != 2 or draws.shape[1] != modes.dimension:
            raise InputError(
                f"draws: must have shape (samples, {modes.dimension}), got shape {draws.shape}"
            )
        if not np.isfinite(draws).all():
            raise InputError("draws: must be finite")
        return modes.gaussian(draws)

    def profiles(self, interface: Interface, draws: Array) -> Array:
        """Map draws (samples, dimension) to profiles (samples, *shape), in the field's unit."""
        if self.conditions is not None:
            draws = conditioning(self, interface).draws(draws)
        return from_normal(self.marginal, self.gaussian(interface, draws))

    @checked
    def given(self, profile: Any, *, noise: Positive) -> RandomField:
        """Return the field conditioned on measured values: fixed there, random elsewhere.

        Its samples use the draws of this field, and tend to its samples as the noise grows.

        Parameters
        ----------
        profile : xarray.DataArray over x (m), on a plane over x and y
            Measured values, in the unit of the field, at any places, such as
            ``st.read_profile("scan.csv")``; NaN where nothing was measured.
        noise : float
            Standard deviation of the error of a value, in the same unit, positive.

        Examples
        --------
        >>> import stiction as st
        >>> import xarray as xr
        >>> problem = st.paper.problem(nodes=256)
        >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
        >>> scan = xr.DataArray([0.8e6, 0.9e6], {"x": [0.01, 0.02]}, "x")
        >>> given = strength.given(scan, noise=10e3)
        >>> tau_p = given.sample(problem.interface, samples=200, seed=0)
        >>> bool(abs(tau_p.mean(axis=0)[26] - 0.8e6) < 50e3)
        True
        """
        if self.conditions is not None:
            raise InputError("profile: the field already has one; join both into one")
        known: Any = {"profile": profile, "noise": noise}
        return dataclasses.replace(self, conditions=known)

    def measured(self, interface: Interface, factor: Any = None) -> Measured:
        """Return the checked measured values, with the marginal of a factor between specimens."""
        given = self.conditions
        assert given is not None
        given.check(self.marginal, interface, factor)
        return Measured(given, self.marginal, self.modes(interface).basis(given.places), factor)

    @checked
    def quantile(self, interface: Interface, probability: Share) -> Array:
        """Return the quantile of the field at each node, given the measured values, (*shape)."""
        mean, deviation = np.zeros(interface.size), np.ones(interface.size)
        if self.conditions is not None:
            grid = np.meshgrid(*interface.coordinates.values(), indexing="ij")
            phi = self.modes(interface).basis(np.array([row.ravel() for row in grid]))
            mean, deviation = conditioning(self, interface).moments(phi)
        found = from_normal(self.marginal, mean + float(ndtri(probability)) * deviation)
        return found.reshape(interface.shape)

    def sample(
        self, interface: Interface, *, samples: int = 1, seed: int = 0, first: int = 0
    ) -> Array:
        """Sample profiles, (samples, *shape), in the field's unit; i depends on (seed, i) only.

        Warns
        -----
        AccuracyWarning
            If the grid is too coarse for the spectrum, or the interface is short compared
            with the correlation length and the field has no mean mode.
        """
        draws = self.draws(interface, samples, seed, first)
        self.warn_if_inaccurate(interface)
        if self.conditions is not None:
            conditioning(self, interface).warn()
        return self.profiles(interface, draws)

    def warn_if_inaccurate(self, interface: Interface) -> None:
        """Warn if the grid is too coarse for the spectrum or the interface too short."""
        modes = self.modes(interface)
        lost = modes.unresolved
        if lost > LOST:
            nodes = " x ".join(map(str, interface.shape))
            enough = " x ".join(map(str, 2 * np.abs(modes.numbers).max(axis=1)))
            warn_accuracy(
                f"the grid of {nodes} nodes is coarser than the spectrum: values at the nodes"
                f" are exact, but {100.0 * lost:.2g} % of the variance lies at wavelengths that the"
                f" grid does not resolve (interface.nodes >= {enough} resolves all)"
            )
        if self.mean_mode:
            return
        with_mean = make_modes(self.spectrum, True, self.anisotropy or 1.0, interface)
        share = float(with_mean.sigma[0] ** 2)
        if share > WITHOUT_MEAN:
            warn_accuracy(
                "the field has no mean mode, which on so short an interface would hold"
                f" {100.0 * share:.2g} % of the variance: all samples have nearly the same mean;"
                " RandomField(mean_mode=True) lets it vary"
            )

    @checked
    def correlation(
        self, interface: Interface, *, of: Literal["strength", "z"] = "strength"
    ) -> Array:
        """Compute the correlation at the lags ``interface.coordinates``, (*shape), periodic.

        It is that of the mapped field (Hermite expansion; Grigoriu, 1995) or of z. An
        `AccuracyWarning` gives its error if the tails of the marginal are too heavy.
        """
        modes = self.modes(interface)
        # The field whose amplitudes are its own standard deviations.
        draws = np.zeros((1, modes.dimension))
        start = int(self.mean_mode)
        draws[0, :start], draws[0, start::2] = modes.sigma[0], modes.sigma[1:]
        rho = modes.gaussian(draws)[0]
        return rho if of == "z" else correlation_of_mapped(rho, self._map_coefficients())

    def _map_coefficients(self) -> Array:
        coefficients = hermite_coefficients(self.marginal)
        # The last coefficient stands for what the expansion leaves out.
        error = float(coefficients[-1] ** 2 / np.sum(coefficients[1:] ** 2))
        if error > UNCERTAIN:
            warn_accuracy(
                f"the correlation of the strength is uncertain by up to {error:.2g}: the tails of"
                " its marginal are too heavy, or its jumps too sharp, for the expansion"
            )
        return coefficients

    def efolding_length(self) -> float:
        """Return the distance (m) at which the correlation of the field first falls to 1/e.

        It is that on a line, on a plane along x; the one of z is `spectrum.efolding_length`.
        """
        coefficients = self._map_coefficients()

        def excess(rho: float) -> float:
            return float(correlation_of_mapped(np.array(rho), coefficients)) - math.exp(-1.0)

        # The correlation of the mapped field is monotone in that of z.
        return lag_of_correlation(self.spectrum, brentq(excess, 0.0, 1.0, xtol=1e-16))


@lru_cache(maxsize=16)
def conditioning(field: RandomField, interface: Interface) -> Conditioning:
    """Return how the draws of a field alone are conditioned on what was measured of it."""
    return Conditioning([field.measured(interface)])
