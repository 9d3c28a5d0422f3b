"""A spectrum of one's own: any density g(k), integrated piece by piece."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import PlainSerializer, WithJsonSchema, model_validator

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.model import Positive, model
from stiction.random.pieces import Pieces, in_pieces
from stiction.random.spectral_density import Share, SpectralDensity, quantile


def _refuse_to_write(function: Any) -> Any:
    name = getattr(function, "__name__", repr(function))
    raise ValueError(f"spectrum.function is the Python function {name!r}; use a named spectrum")


LONGEST, SHORTEST = 1e-6, 1e12
"""Wavenumbers between which a spectrum of one's own is integrated octave by octave, rad/m."""


@model
class CustomSpectrum(SpectralDensity):
    """A spectrum of your own: any g(k), up to a factor.

    Parameters
    ----------
    function : callable
        g(k): takes an array of wavenumbers (rad/m), returns an array, not negative, integrable.
        On a plane it is the density there, at wave vectors of length k, so that g(k) k must be
        integrable; a line cut through the plane then has another spectrum than g.
    max_wavenumber : float, optional
        Truncation, rad/m; by `power_kept` if left out.
    power_kept : float, optional
        Share of the power kept by truncation; 0.9997 if neither is given.
    break_points : sequence of float
        Wavenumbers (rad/m, positive) at which g jumps or has a peak. Lines and steps wider than
        1/4096 of an octave are found without; a narrower line needs its two ends here.

    Raises
    ------
    InputError
        If the function is not a density, or its integral does not settle.

    Notes
    -----
    For Python only: a study with a function of your own cannot be written to a file. The power,
    cumulative and truncated, comes from Legendre expansions that are compared with the function
    and refined until they agree to 1e-11 of the power.
    """

    function: Annotated[
        Callable[[Any], Any], PlainSerializer(_refuse_to_write), WithJsonSchema({"not": {}})
    ]
    max_wavenumber: Positive | None = None
    power_kept: Share | None = None
    break_points: tuple[Positive, ...] = ()
    type: Literal["custom"] = "custom"

    @model_validator(mode="after")
    def _is_a_density(self) -> CustomSpectrum:
        if self.max_wavenumber is not None and self.power_kept is not None:
            raise InputError("give max_wavenumber or power_kept, not both")
        probe = np.geomspace(1e-3, 1e6, 64)
        try:
            values = np.asarray(self.function(probe), dtype=np.float64)
        except Exception as error:
            raise InputError(f"function: fails on an array of wavenumbers: {error!r}") from None
        if values.shape != probe.shape or not np.all(np.isfinite(values)) or values.min() < 0.0:
            raise InputError("function: must map (m,) wavenumbers to (m,) finite values >= 0")
        pieces = _whole(self)
        if not 0.0 < pieces.total < np.inf:
            raise InputError("function: its integral over wavenumbers must be positive and finite")
        last = 1.0 - pieces.within(1e-3 * SHORTEST) / pieces.total
        if self.max_wavenumber is None and last > 1e-3:
            raise InputError(
                f"function: {100.0 * last:.2g} % of its power lie above {1e-3 * SHORTEST:g} rad/m:"
                " its integral does not converge; give max_wavenumber"
            )
        return self

    def _edges_to(self, end: float) -> Array:
        octaves = np.exp2(np.arange(math.log2(LONGEST), math.log2(SHORTEST)))
        inner = [k for k in (*octaves, *self.break_points) if k < end]
        return np.unique([0.0, *inner, end])

    @property
    def _edges(self) -> Array:
        return self._edges_to(self.cutoff)

    def density(self, wavenumber: Array) -> Array:
        """g(k) at k in rad/m, up to a factor."""
        return np.array(self.function(np.asarray(wavenumber)), dtype=np.float64)

    def power_integral(self, wavenumber: float) -> float:
        """Integral of g from 0 to `wavenumber`, or to `max_wavenumber` if that is less."""
        return _whole(self).within(wavenumber)

    def power_within(self, wavenumber: float) -> float:
        """Share of the power below `wavenumber`, of that below `max_wavenumber` if given."""
        return min(self.power_integral(wavenumber) / _whole(self).total, 1.0)

    @property
    def cutoff(self) -> float:
        """Wavenumber above which the spectrum is truncated, rad/m."""
        if self.max_wavenumber is not None:
            return self.max_wavenumber
        return _cutoff_of(self, 0.9997 if self.power_kept is None else self.power_kept)

    def plane_density(self, wavenumber: Array) -> Array:
        """g(k): of a spectrum of one's own it is the density of what it is used for."""
        return self.density(wavenumber)

    def plane_power_integral(self, wavenumber: float) -> float:
        """Integral of g(k) k from 0 to `wavenumber`, or to `max_wavenumber` if that is less."""
        return _whole_plane(self).within(wavenumber)

    def plane_power_within(self, wavenumber: float) -> float:
        """Share of the power at wave vectors shorter than `wavenumber`."""
        return min(self.plane_power_integral(wavenumber) / _whole_plane(self).total, 1.0)

    @property
    def plane_cutoff(self) -> float:
        """Length of wave vector above which the spectrum of a plane is truncated, rad/m."""
        if self.max_wavenumber is not None:
            return self.max_wavenumber
        return _plane_cutoff_of(self, 0.9997 if self.power_kept is None else self.power_kept)

    def untruncated_correlation(self, lag: Array) -> Array:
        """Correlation of the whole spectrum at `lag` (m), up to `max_wavenumber` if given."""
        pieces = _whole(self)
        result: Array = pieces.cosine(lag) / pieces.total
        return result


@lru_cache(maxsize=64)
def _whole(spectrum: CustomSpectrum) -> Pieces:
    end = SHORTEST if spectrum.max_wavenumber is None else spectrum.max_wavenumber
    return in_pieces(spectrum.density, spectrum._edges_to(end))


@lru_cache(maxsize=64)
def _cutoff_of(spectrum: CustomSpectrum, share: float) -> float:
    return spectrum._power_quantile(share)


@lru_cache(maxsize=64)
def _whole_plane(spectrum: CustomSpectrum) -> Pieces:
    end = SHORTEST if spectrum.max_wavenumber is None else spectrum.max_wavenumber
    return in_pieces(lambda k: k * spectrum.density(k), spectrum._edges_to(end))


@lru_cache(maxsize=64)
def _plane_cutoff_of(spectrum: CustomSpectrum, share: float) -> float:
    if 1.0 - spectrum.plane_power_within(1e-3 * SHORTEST) > 1e-3:
        raise InputError(
            "spectrum: on a plane the power of g(k) is the integral of g(k) k, which does not"
            " converge; give max_wavenumber"
        )
    return quantile(spectrum.plane_power_within, share)
