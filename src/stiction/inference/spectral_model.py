"""Correlation at the points of a record from a spectrum: truncation and aliasing included."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import fft

from stiction.arrays import Array

EDGE = 0.2
"""Share of the truncation over which a spectrum is faded out: a sharper end would be taken for a
precise measure of the correlation length, which it is in simulations only."""
LEFT_OUT = 1e-4
"""Share of the variance above the end of a spectrum that is not truncated."""
FOLDS = 6
"""Multiples of the sampling wavenumber that are folded back one by one."""
NEAR, FEW = 1, 65
"""Of those multiples on a line the ones that need all wavenumbers, and how many the others do."""
ROOM = {1: 4, 2: 2}
"""Period of the grid on which a correlation is computed, in lengths of the record."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Points of a record, (*shape), `spacings` (m) apart, continued to a period."""

    shape: tuple[int, ...]
    spacings: tuple[float, ...]

    @property
    def whole(self) -> tuple[int, ...]:
        """Points in a period."""
        room = ROOM[len(self.shape)]
        return tuple(fft.next_fast_len(room * n, real=True) for n in self.shape)

    def power(self, spectrum: Any, anisotropy: float = 1.0, *, end_seen: bool = True) -> Array:
        """Variance of z in each mode of a real transform of the grid; it sums to 1 over all.

        The spectrum fades out at its truncation; what lies above the sampling wavenumber is folded
        back, and what lies above `FOLDS` times that, which is flat by then, evenly. With
        `end_seen` false it is not truncated: what a truncation leaves out of a rough spectrum
        would be taken for noise.
        """
        dimensions = len(self.shape)
        stretch = (1.0, anisotropy)[:dimensions]
        sampling = [a * 2.0 * math.pi / d for a, d in zip(stretch, self.spacings, strict=True)]
        if end_seen:
            cutoff = spectrum.cutoff(dimensions)
        else:
            cutoff = max(spectrum.quantile(1.0 - LEFT_OUT, dimensions), *sampling)
        ranges = [min(FOLDS, math.ceil(cutoff / s + 0.5)) for s in sampling]
        end = min(cutoff, *(s * (r + 0.5) for s, r in zip(sampling, ranges, strict=True)))
        axes = [s * fft.fftfreq(n) for s, n in zip(sampling, self.whole, strict=True)]
        axes[-1] = sampling[-1] * fft.rfftfreq(self.whole[-1])
        folded = _folded_line if dimensions == 1 else _folded_plane
        total = folded(spectrum, axes, ranges, sampling, end)
        missed = 0.0
        if end < cutoff:
            kept = [spectrum.power_within(k, dimensions) for k in (end, cutoff)]
            missed = 1.0 - kept[0] / kept[1]
        # Most modes of a real transform stand for two of a whole one.
        all_modes = 2.0 * total.sum() - total[..., 0].sum()
        if self.whole[-1] % 2 == 0:
            all_modes -= total[..., -1].sum()
        total *= (1.0 - missed) / all_modes
        total += missed / math.prod(self.whole)
        return total

    def correlation(self, power: Array) -> Array:
        """Of z at the lags 0, ..., n - 1, -n, ..., -1 of a record, (2 n) in each direction."""
        whole: Array = fft.irfftn(power, self.whole) * math.prod(self.whole)
        lags = [np.r_[:n, m - n : m] for n, m in zip(self.shape, self.whole, strict=True)]
        return whole[np.ix_(*lags)]

    def sample(self, power: Array, rng: np.random.Generator) -> Array:
        """A record of z, (*shape): a piece of a period of the grid."""
        white = fft.rfftn(rng.standard_normal(self.whole))
        whole = fft.irfftn(white * np.sqrt(power * math.prod(self.whole)), self.whole)
        result: Array = whole[tuple(slice(n) for n in self.shape)]
        return result


def _fade(k: Array, end: float) -> Array:
    return np.clip((end - k) / (EDGE * end) + 0.5, 0.0, 1.0)


def _folded_line(
    spectrum: Any, axes: list[Array], ranges: list[int], sampling: list[float], end: float
) -> Array:
    """The density at all wavenumbers that look alike on the grid, added up."""

    def added(at: Array, folds: Array) -> Array:
        k = np.abs(at + folds[:, None] * sampling[0])
        found: Array = np.sum(spectrum.density(k) * _fade(k, end), axis=0)
        return found

    near = min(ranges[0], NEAR)
    line = added(axes[0], np.arange(-near, near + 1))
    if ranges[0] > near:  # smooth by then
        far = np.arange(near + 1, ranges[0] + 1)
        few = np.linspace(0.0, axes[0][-1], FEW)
        line += np.interp(axes[0], few, added(few, np.concatenate([-far, far])))
    return line


def _folded_plane(
    spectrum: Any, axes: list[Array], ranges: list[int], sampling: list[float], end: float
) -> Array:
    """The same on a plane."""
    found = np.zeros((axes[0].size, axes[1].size))
    for p in range(-ranges[0], ranges[0] + 1):
        for q in range(-ranges[1], ranges[1] + 1):
            kx, ky = axes[0] + p * sampling[0], axes[1] + q * sampling[1]
            if math.hypot(np.abs(kx).min(), np.abs(ky).min()) <= (1.0 + EDGE) * end:
                k = np.hypot(kx[:, None], ky[None, :])
                found += spectrum.density(k, 2) * _fade(k, end)
    return found
