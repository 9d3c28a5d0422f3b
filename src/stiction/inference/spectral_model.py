"""Correlation at the points of a record from a spectrum: truncation and aliasing included."""

from __future__ import annotations

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
    """Points of a record, continued to a period several times as long.

    Attributes
    ----------
    shape : tuple of int
        Of the record.
    spacings : tuple of float
        m.
    """

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
        cutoff = spectrum.cutoff(dimensions)
        sampling = [2.0 * math.pi / d for d in self.spacings]
        steps = [s / n for s, n in zip(sampling, self.whole, strict=True)]
        stretch = (1.0, anisotropy)[: len(self.shape)]
        if not end_seen:
            cutoff = spectrum.quantile(1.0 - LEFT_OUT, dimensions)
            cutoff = max(cutoff, *(a * s for a, s in zip(stretch, sampling, strict=True)))
        ranges = [
            min(FOLDS, math.ceil(cutoff / (a * s) + 0.5))
            for a, s in zip(stretch, sampling, strict=True)
        ]
        reach = [a * s * (r + 0.5) for a, s, r in zip(stretch, sampling, ranges, strict=True)]
        end = min(cutoff, *reach)
        axes = []
        for axis, (n, step) in enumerate(zip(self.whole, steps, strict=True)):
            last = axis == len(self.shape) - 1
            number = np.arange(n // 2 + 1) if last else fft.fftfreq(n, 1.0 / n)
            axes.append(stretch[axis] * step * number)
        total = self._folded(spectrum, axes, ranges, sampling, stretch, end)
        missed = 0.0
        if end < cutoff:
            kept = [spectrum.power_within(k, dimensions) for k in (end, cutoff)]
            missed = 1.0 - kept[0] / kept[1]
        weight = self._doubled(total.shape)
        total *= (1.0 - missed) / float(np.sum(weight * total))
        total += missed / math.prod(self.whole)
        return total

    def _folded(
        self, spectrum: Any, axes: list[Array], ranges: list[int],
        sampling: list[float], stretch: tuple[float, ...], end: float,
    ) -> Array:  # fmt: skip
        """The density at all wavenumbers that look alike on the grid, added up."""

        def kept(k: Array) -> Array:
            return np.clip((end - k) / (EDGE * end) + 0.5, 0.0, 1.0)

        def added(at: Array, folds: Array) -> Array:
            k = np.abs(at + folds[:, None] * sampling[0])
            found: Array = np.sum(spectrum.density(k) * kept(k), axis=0)
            return found

        if len(axes) == 1:
            near = min(ranges[0], NEAR)
            line = added(axes[0], np.arange(-near, near + 1))
            if ranges[0] > near:  # smooth by then
                far = np.arange(near + 1, ranges[0] + 1)
                few = np.linspace(0.0, axes[0][-1], FEW)
                line += np.interp(axes[0], few, added(few, np.concatenate([-far, far])))
            return line
        found = np.zeros((axes[0].size, axes[1].size))
        for p in range(-ranges[0], ranges[0] + 1):
            for q in range(-ranges[1], ranges[1] + 1):
                kx = axes[0] + p * stretch[0] * sampling[0]
                ky = axes[1] + q * stretch[1] * sampling[1]
                if min(np.abs(kx).min(), np.abs(ky).min()) > (1.0 + EDGE) * end:
                    continue
                k = np.hypot(kx[:, None], ky[None, :])
                found += spectrum.density(k, 2) * kept(k)
        return found

    def _doubled(self, shape: tuple[int, ...]) -> Array:
        """How many modes of a whole transform each of a real one stands for."""
        weight = np.full(shape[-1], 2.0)
        weight[0] = 1.0
        if self.whole[-1] % 2 == 0:
            weight[-1] = 1.0
        return np.broadcast_to(weight, shape)

    def correlation(self, power: Array) -> Array:
        """Of z at the lags 0, ..., n - 1, -n, ..., -1 of a record, (2 n) in each direction."""
        whole = fft.irfftn(power, self.whole) * math.prod(self.whole)
        for axis, (n, m) in enumerate(zip(self.shape, self.whole, strict=True)):
            lags = np.arange(2 * n)
            lags = np.where(lags < n, lags, lags - 2 * n) % m
            whole = np.take(whole, lags, axis=axis)
        result: Array = whole
        return result

    def sample(self, power: Array, rng: np.random.Generator) -> Array:
        """A record of z, (*shape): a piece of a period of the grid."""
        white = fft.rfftn(rng.standard_normal(self.whole))
        whole = fft.irfftn(white * np.sqrt(power * math.prod(self.whole)), self.whole)
        result: Array = whole[tuple(slice(n) for n in self.shape)]
        return result
