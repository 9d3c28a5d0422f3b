"""What a fit of a random field to measured profiles gives, and how far it may be trusted."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from stiction.arrays import Array
from stiction.inference.bootstrap import RANGES
from stiction.inference.estimate import Estimate, Setting
from stiction.inference.records import Record
from stiction.inference.whittle import Observed
from stiction.profiles import UNITS
from stiction.random.random_field import RandomField

if TYPE_CHECKING:
    pass


@dataclass(frozen=True)
class Goodness:
    """How well a family describes the values at a point.

    Attributes
    ----------
    marginal
        The member that fits best.
    distance : float
        Largest difference of the distribution functions (Kolmogorov).
    score : float
        Log likelihood of as many independent values as the record holds correlation lengths, less
        the number of parameters; differences below about 2 mean nothing.
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
        What was estimated, in SI: ``marginal.*`` and ``spectrum.*`` by the names that study files
        use, ``mean`` and ``standard_deviation`` of the field, ``efolding_length`` (m) at which the
        correlation of z falls to 1/e, ``anisotropy``, and ``noise``, the standard deviation of the
        measurement noise.
    interval : dict of str to (float, float)
        Of each of them, from the bootstrap; within what is searched, and of bounds of the marginal
        outside the values.
    confidence : float
        Of the intervals.
    repetitions : tuple of RandomField
        The fits to records simulated from `field`: what another measurement might have given.
    families : dict of str to Goodness
        Of every family of marginals that was asked for.
    misfit : dict of str to float
        Shares of the repetitions that are as far from their own marginal, and spectrum, as the
        data are from the fitted ones; small where a family does not suit. A share below 1 % takes
        at least 99 repetitions to tell.
    lengths_held : float
        Correlation lengths (on a plane, areas) that the records hold together.
    warnings : tuple of str
        What stands in the way of trusting it; empty if nothing does.
    cut_short : bool
        Whether `time_limit` ended the repetitions early.
    """

    field: RandomField
    parameters: Mapping[str, float]
    interval: Mapping[str, tuple[float, float]]
    confidence: float
    repetitions: tuple[RandomField, ...] = dataclasses.field(repr=False)
    families: Mapping[str, Goodness] = dataclasses.field(repr=False)
    misfit: Mapping[str, float] = dataclasses.field(repr=False)
    lengths_held: float = dataclasses.field(repr=False)
    quantity: str = dataclasses.field(repr=False)
    _details: Details = dataclasses.field(repr=False)
    warnings: tuple[str, ...] = ()
    cut_short: bool = False

    def __str__(self) -> str:
        unit = UNITS[self.quantity]
        width = max(len(name) for name in self.parameters)
        lines = [
            f"{_title(self.field)} from {self.lengths_held:.3g} correlation lengths,"
            f" {100 * self.confidence:g} % intervals"
        ]
        for name, value in self.parameters.items():
            low, high = self.interval[name]
            suffix = unit_of(name, unit)
            least, most = RANGES.get(name, (-math.inf, math.inf))
            if low <= least or high >= most:
                suffix += f" (searched from {least:g} to {most:g})"
            line = f"  {name:{width}s}  {value:<11.5g} {low:.4g} to {high:.4g}"
            lines.append(f"{line} {suffix.strip()}".rstrip())
        marginal, spectrum = (100.0 * self.misfit[name] for name in ("marginal", "spectrum"))
        lines.append(
            f"  as far from its marginal as {marginal:.3g} % of {len(self.repetitions)} simulated"
            f" records, from its spectrum as {spectrum:.3g} %"
        )
        lines += [f"  ! {text}" for text in self.warnings]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


@dataclass(frozen=True, eq=False)
class Details:
    """What the figure needs of a fit."""

    values: Array
    records: tuple[Record, ...]
    estimate: Estimate
    setting: Setting
    observed: tuple[Observed, ...]
    repeated: tuple[Estimate, ...]


def _title(found: RandomField) -> str:
    marginal = getattr(found.marginal, "type", "marginal").replace("_", " ")
    return f"{marginal} marginal, {found.spectrum.type.replace('_', ' ')} spectrum"


def unit_of(name: str, unit: str) -> str:
    """SI unit of a parameter of a field in `unit`; empty for pure numbers."""
    last = name.rpartition(".")[2]
    if last in ("correlation_length", "efolding_length"):
        return "m"
    stresses = ("mean", "standard_deviation", "noise", "low", "high", "loc", "scale")
    return "" if last not in stresses or unit == "1" else unit
