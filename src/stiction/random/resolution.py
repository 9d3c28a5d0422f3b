"""Whether grid and interface resolve a random field; warnings that say by how much not."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from stiction.errors import warn_accuracy
from stiction.interface import Interface
from stiction.random.custom_spectrum import CustomSpectrum

if TYPE_CHECKING:
    from stiction.random.random_field import RandomField

FEWEST_LENGTHS = 4.0


def warn_if_inaccurate(field: RandomField, interface: Interface) -> None:
    """Warn of a grid coarser than the spectrum and of an interface short against xi_0."""
    modes = field.modes(interface)
    lost = modes.unresolved(interface)
    if lost > 1e-4:
        nodes = " x ".join(map(str, interface.shape))
        enough = " x ".join(str(2 * most) for most in modes.highest)
        warn_accuracy(
            f"the grid of {nodes} nodes is coarser than the spectrum: values at the nodes"
            f" are exact, but {100.0 * lost:.2g} % of the variance lies at wavelengths that the"
            f" grid does not resolve (interface.nodes >= {enough} resolves all)"
        )
    if isinstance(field.spectrum, CustomSpectrum):
        _warn_of_lines(field, interface)
    if field.mean_mode:
        return
    if interface.is_plane:
        gap = _lowest_correlation(field, interface)
        if gap > 0.02:
            warn_accuracy(
                "the plane is short against the correlation length and the field has no mean mode:"
                f" the correlation falls to {-gap:.2f} instead of 0;"
                " RandomField(mean_mode=True) restores the mean's variability"
            )
        return
    ratio = interface.extent / field.spectrum.efolding_length
    if ratio < 2.0 * math.pi * FEWEST_LENGTHS:
        gap = _lowest_correlation(field, interface)
        if gap > 0.02:
            warn_accuracy(
                f"the interface is only {ratio:.1f} e-folding lengths long and the field has no"
                f" mean mode: the correlation falls to {-gap:.2f} instead of 0;"
                " RandomField(mean_mode=True) restores the mean's variability"
            )


@lru_cache(maxsize=64)
def _lowest_correlation(field: RandomField, interface: Interface) -> float:
    """By how much the correlation of z falls below zero."""
    return -float(field.correlation(interface, of="z").min())


def _warn_of_lines(field: RandomField, interface: Interface) -> None:
    """Warn where the modes of an interface fall beside or upon something narrow."""
    spectrum, modes = field.spectrum, field.modes(interface)
    if modes.count < 1 or not isinstance(spectrum, CustomSpectrum):
        return
    if interface.is_plane:  # in units in which a whole plane of wave vectors is the integral
        ratio_y = field.anisotropy or 1.0
        cell = (2.0 * math.pi) ** 2 / interface.extent * ratio_y
        k = modes.lengths(interface, ratio_y)[1:]
        seen = cell * (
            2.0 * float(spectrum.plane_density(k).sum())
            + float(spectrum.plane_density(0.0 * k[:1]))
        )
        whole = 2.0 * math.pi * spectrum.plane_power_integral(spectrum.plane_cutoff)
        apart = f"{2.0 * math.pi / max(interface.lengths):.3g}"
    else:
        step = 2.0 * math.pi / interface.extent
        seen = step * float(spectrum.density(step * np.arange(1, modes.count + 1)).sum())
        ends = [spectrum.power_integral(k) for k in (0.5 * step, (modes.count + 0.5) * step)]
        whole = ends[1] - ends[0]
        apart = f"{step:.3g}"
    ratio = seen / whole if whole > 0.0 else np.inf
    if abs(ratio - 1.0) > 0.1:
        warn_accuracy(
            f"the modes of this interface, {apart} rad/m apart, carry {ratio:.3g} times the"
            " power of the spectrum: it has lines or steps narrower than that, which a longer"
            " interface would resolve"
        )
