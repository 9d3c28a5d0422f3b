"""What a fit of a random field to measured profiles gives, and how far it may be trusted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from stiction.arrays import Array
from stiction.inference.bootstrap import RANGES
from stiction.inference.estimate import Estimate, Setting
from stiction.inference.whittle import Observed
from stiction.profiles import UNITS
from stiction.random.random_field import RandomField

AT_END = (
    "{name} {value:.3g} lies at the end of the range that is searched, {limit:.3g}: the data do not"
    " determine it; give it"
)
DOUBTS = {
    "lengths_held": "the records hold {value:.2g} correlation lengths, too few for intervals to be"
    " trusted: at least {limit:g} are needed; measure a longer piece, or several",
    "noise": "the noise ({value:.3g}) hides the cut-off of the spectrum, where the field has"
    " {limit:.3g} left: the correlation length rests on the family, not on the data",
    "marginal": "the p-value of the marginal is {value:.2g}, below {limit:g}: the values are far"
    " from its family; compare families, or look at st.plot.fit",
    "spectrum": "the p-value of the spectrum is {value:.2g}, below {limit:g}: the periodogram is"
    " far from its family; take another spectrum or a higher detrend, or look at st.plot.fit",
    "repetitions": "intervals are from {value:g} of {limit:g} repetitions: the family could not be"
    " fitted to the others",
}


class Doubt(NamedTuple):
    """What stands in the way of trusting a fit: a quantity beyond its limit."""

    name: str
    value: float
    limit: float

    def __str__(self) -> str:
        return DOUBTS.get(self.name, AT_END).format(**self._asdict())


class Goodness(NamedTuple):
    """How well a family describes the values at a point.

    Attributes
    ----------
    marginal
        The member that fits best.
    distance : float
        Largest difference of the distribution functions (Kolmogorov).
    score : float
        Log likelihood of as many independent values as the record holds correlation lengths, less
        the number of parameters, and less that of the best family; differences below about 2 mean
        nothing.
    """

    marginal: Any
    distance: float
    score: float


@dataclass(frozen=True, eq=False)
class FieldFit:
    """A random field fitted to measured profiles, and how far it may be trusted.

    Attributes
    ----------
    field : RandomField
        To simulate with, without the measurement noise; it has the mean mode.
    parameters : dict of str to float
        What was estimated, in SI: ``efolding_length`` (m), at which the correlation of z falls to
        1/e; ``mean`` and ``standard_deviation`` of the field; ``marginal.*`` and ``spectrum.*`` by
        the names that study files use; ``anisotropy``; ``noise``, the standard deviation of the
        measurement noise; and ``between``, the coefficient of variation between specimens.
    interval : dict of str to (float, float)
        Of each of them, from the bootstrap; within what is searched, and of bounds of the marginal
        outside the values.
    confidence : float
        Of the intervals.
    repetitions : tuple of RandomField
        The fits to records simulated from `field`: what another measurement might have given.
    families : dict of str to Goodness
        Of every family of marginals that was asked for.
    p_values : dict of str to float
        Shares of the repetitions that are as far from their own marginal, and spectrum, as the
        data are from the fitted ones (Barnard's test); small where a family does not suit.
    lengths_held : float
        Correlation lengths (on a plane, areas) that the records hold together.
    missing : (int, int)
        Points without a value, which are left out, and all points.
    doubts : tuple of Doubt
        What stands in the way of trusting it; empty if nothing does.
    """

    field: RandomField
    parameters: Mapping[str, float]
    interval: Mapping[str, tuple[float, float]]
    confidence: float
    repetitions: tuple[RandomField, ...]
    families: Mapping[str, Goodness]
    p_values: Mapping[str, float]
    lengths_held: float
    missing: tuple[int, int]
    quantity: str
    doubts: tuple[Doubt, ...]
    _details: Details

    def __str__(self) -> str:
        width = max(map(len, self.parameters))
        marginal = getattr(self.field.marginal, "type", "marginal").replace("_", " ")
        spectrum = self.field.spectrum.type.replace("_", " ")
        lines = [
            f"{marginal} marginal, {spectrum} spectrum from {self.lengths_held:.3g} correlation"
            f" lengths, {100 * self.confidence:g} % intervals"
        ]
        if self.missing[0]:
            lines.append("  {} of {} points are missing and left out".format(*self.missing))
        for name, value in self.parameters.items():
            if name == "mean" and "marginal.mean" in self.parameters:
                continue  # the same number
            low, high = self.interval[name]
            suffix = unit_of(name, UNITS[self.quantity])
            least, most = RANGES.get(name, (-math.inf, math.inf))
            if low <= least or high >= most:
                suffix += f" (searched from {least:g} to {most:g})"
            line = f"  {name:{width}s}  {value:<11.5g} {low:.4g} to {high:.4g}"
            lines.append(f"{line} {suffix.strip()}".rstrip())
        lines.append(
            f"  p-values: marginal {self.p_values['marginal']:.3g}, spectrum"
            f" {self.p_values['spectrum']:.3g} ({len(self.repetitions)} repetitions)"
        )
        return "\n".join([*lines, *(f"  ! {doubt}" for doubt in self.doubts)])

    __repr__ = __str__


class Details(NamedTuple):
    """What the figure needs of a fit."""

    values: Array
    estimate: Estimate
    setting: Setting
    observed: tuple[Observed, ...]
    repeated: tuple[Estimate, ...]


def unit_of(name: str, unit: str) -> str:
    """SI unit of a parameter of a field in `unit`; empty for pure numbers."""
    last = name.rpartition(".")[2]
    if last in ("correlation_length", "efolding_length"):
        return "m"
    stresses = ("mean", "standard_deviation", "noise", "low", "high", "loc", "scale")
    return "" if last not in stresses or unit == "1" else unit
