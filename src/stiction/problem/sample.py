"""The profiles of samples, and the conditions that they meet together."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.representation import Result, Row, Summary
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.interface import Interface

MAX_STRENGTH_RATIO = 1e8
"""Strength of a node over the median beyond which others are lost in round-off."""
BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, by rank, of
nodes that weaken."""


def steepest_weakening_rate(strength: Array, residual: Array, weakening_rate: Array) -> float:
    """Return the largest weakening rate, Pa/m, among nodes that may break.

    Arrays have shape (samples, *shape). Barriers do not count: with a
    uniform critical slip they weaken steeply but never slip.
    """
    drop = strength - residual
    if drop.max() <= BARRIER * drop.min() or weakening_rate.max() == weakening_rate.min():
        return float(weakening_rate.max())
    drop = drop.reshape(drop.shape[0], -1)
    weakens = np.isfinite(drop) & (drop > 0.0)
    count = weakens.sum(axis=1, keepdims=True)
    # numpy's quantile takes 20 times as long.
    ordered = np.sort(np.where(weakens, drop, -np.inf), axis=1)
    typical = np.take_along_axis(ordered, drop.shape[1] - count + (count - 1) // 4, axis=1)
    return float(weakening_rate.reshape(drop.shape)[drop <= BARRIER * typical].max())


class _Profiles(NamedTuple):
    """The profiles of a `Sample`."""

    strength: Array
    residual_strength: Array
    weakening_rate: Array
    initial_stress: Array
    load_profile: Array
    normal_pressure: Array
    problem: Any = None


class Sample(Result, _Profiles):
    """The profiles of one or more interfaces, from which every method starts.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, *shape) arrays
        tau_p, tau_r (Pa), W at zero slip (Pa/m), tau_i (Pa). Do not
        write to these arrays. The strength is infinite beyond the
        extent of the interface. If a strength is not above the residual
        strength, both are set equal and W has no effect.
    load_profile : (*shape) array
        p, dimensionless, positive.
    normal_pressure : (samples, *shape) array
        In Pa, NaN if the problem has no pressure.
    problem : Problem, optional
        The problem that made the sample. Other problems do not accept
        the sample. A sample made by hand has no problem.
    """

    def _summary(self) -> Summary:
        rows = []
        for name, values in self._asdict().items():
            if name in QUANTITIES and not np.isnan(values).all():
                ends = float(np.min(values)), float(np.max(values))
                rows.append(Row(name, float(np.mean(values)), ends, QUANTITIES[name].units))
        nodes = " x ".join(map(str, self.shape))
        count = f"{self.samples} interface" + "s" * (self.samples != 1)
        return Summary(f"{count} of {nodes} nodes, means", rows, "range")

    @property
    def samples(self) -> int:
        """Number of samples."""
        return int(self.strength.shape[0])

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of nodes in each direction."""
        return self.load_profile.shape

    @property
    def axes(self) -> tuple[int, ...]:
        """Axes of the nodes, counted from the last."""
        return tuple(range(-self.load_profile.ndim, 0))

    def part(self, some: slice) -> Sample:
        """Return some samples of the batch."""
        rows_of_part = {
            name: rows[some] for name, rows in self._asdict().items() if name in PROFILES
        }
        return self._replace(**rows_of_part)

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        flat = self.weakening_rate.reshape(self.samples, -1)
        return bool(np.all(flat == flat[:, :1]))

    def mean(self, profiles: Array) -> Array:
        """Return the mean of each profile over the nodes that can break: (..., *shape) to (...)."""
        if self.problem is None:
            return np.asarray(profiles.mean(axis=self.axes))
        return np.asarray(self.problem.interface.mean(profiles))

    @property
    def mean_strength(self) -> float:
        """Mean of the finite strengths, Pa."""
        return float(self.strength.mean(where=np.isfinite(self.strength)))

    @property
    def steepest_weakening_rate(self) -> float:
        """Largest weakening rate, Pa/m, among nodes that may break."""
        W = self.weakening_rate
        return steepest_weakening_rate(self.strength, self.residual_strength, W)

    def mean_stress(self, load: Array) -> Array:
        """Return <tau_i> + tau_0 <p>, Pa, at loads tau_0 with shape (samples,)."""
        return self.mean(self.initial_stress) + load * self.mean(self.load_profile)


def contradictions_of(
    interface: Interface, strength: Array, residual: Array, initial: Array, overstress: bool
) -> list[str]:
    """Return why profiles (samples, *shape), Pa, with valid values do not fit together.

    With `overstress`, the initial stress may exceed the strength.
    """
    along, problems = interface.axes, []
    over = (strength <= initial).reshape(len(strength), -1)
    if not overstress and over.any():
        number = int(over.any(axis=1).argmax())
        node = int(over[number].argmax())
        most, least = initial[number].flat[node], strength[number].flat[node]
        further = int(over.any(axis=1).sum()) - 1
        problems.append(
            f"strength: must be above initial_stress. It is not at {over[number].sum()} nodes of"
            f" sample {number}, such as {interface.describe_node(node)}: {least:g} and {most:g} Pa"
            f"{f', and in {further} more samples' * (further > 0)}. st.Rupture() accepts this"
        )
    if (
        np.max(strength, where=np.isfinite(strength), initial=0.0)
        > MAX_STRENGTH_RATIO * strength.min()
    ):
        middle = np.median(strength, axis=along, keepdims=True)
        huge = np.isfinite(strength) & (strength > MAX_STRENGTH_RATIO * middle)
        if middle.min() <= 0.0:
            problems.append(
                f"strength: must be positive. Its median in sample {int(np.argmin(middle))} is"
                f" {middle.min():g} Pa: check its sign"
            )
        elif huge.any():
            number, node = np.argwhere(huge.reshape(len(strength), -1))[0].tolist()
            problems.append(
                f"strength: {strength[number].flat[node]:g} Pa at {interface.describe_node(node)}"
                f" of sample {number} is more than {MAX_STRENGTH_RATIO:g} times the median,"
                f" {middle[number].item():g} Pa. Where nothing breaks, give a smaller strength"
            )
    nowhere = ~((strength > residual) & np.isfinite(strength)).any(axis=along)
    if nowhere.any():
        number = int(np.argmax(nowhere))
        known = strength[number][np.isfinite(strength[number])]
        problems.append(
            "strength: must be above residual_strength at one node or more. In sample"
            f" {number} strength is {known.min():g} to {known.max():g} Pa, and residual_strength is"
            f" {residual[number].min():g} to {residual[number].max():g} Pa: check their units"
        )
    return problems
