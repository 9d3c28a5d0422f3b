"""The profiles of samples, and their construction from given arrays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.model import as_numbers
from stiction.base.representation import Result, Row, Summary
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.friction import SCALES
from stiction.problem.interface import Interface
from stiction.problem.profiles.labels import is_coefficient
from stiction.problem.profiles.placing import turned

LARGEST = 1e100
"""Of a profile, in SI units; sums and products of larger numbers overflow."""
FRICTION = (1e-3, 10.0), (1e-4, 100.0)
"""Mean strength over normal pressure, from superlubricity to adhesive gels."""
BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, by rank, of
nodes that weaken."""


def steepest_weakening_rate(strength: Array, residual: Array, weakening_rate: Array) -> float:
    """Return the largest weakening rate, Pa/m, among nodes that may break.

    Arrays have shape (samples, *shape). Barriers do not count: with a uniform
    critical slip they weaken steeply but never slip.
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
        tau_p, tau_r (Pa), W at zero slip (Pa/m), tau_i (Pa). Do not write to these
        arrays. The strength is infinite beyond the extent of the interface. If a
        strength is not above the residual strength, both are set equal and W has no
        effect.
    load_profile : (*shape) array
        p, dimensionless, positive.
    normal_pressure : (samples, *shape) array
        In Pa, NaN if the problem has no pressure.
    problem : Problem, optional
        The problem that made the sample. Other problems do not accept the sample. A
        sample made by hand has no problem.
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
        rates = self.weakening_rate
        return steepest_weakening_rate(self.strength, self.residual_strength, rates)

    def mean_stress(self, load: Array) -> Array:
        """Return <tau_i> + tau_0 <p>, Pa, at loads tau_0 with shape (samples,)."""
        return self.mean(self.initial_stress) + load * self.mean(self.load_profile)


def rows_of(name: str, value: Any, interface: Interface, samples: int | None) -> Array:
    """Return `value` as a (samples, *shape) float64 array, or raise an `InputError`.

    A single profile (*shape) counts as one sample. If `samples` is given, a number, a
    profile, or one number per sample with shape (samples, 1) is broadcast to
    (samples, *shape).
    """
    shape, array = interface.shape, as_numbers(value)
    valid = f"{shape} or ({samples or 'samples'}, {', '.join(map(str, shape))})"
    if samples is None:
        fits = array.size > 0 and shape in (array.shape, array.shape[1:])
    else:
        valid += f", ({samples}, 1) or a number"
        column = (samples, *(1 for _ in shape))
        array = array.reshape(column) if array.shape == (samples, 1) else array
        fits = array.shape in ((), shape, column, (samples, *shape))
    if not fits:
        hint = turned(array.shape[-2:], shape)
        raise InputError(f"must have shape {valid}, got shape {array.shape}{hint}")
    check_values(name, array, interface)
    if samples is None:
        return array.reshape(-1, *shape)
    return np.broadcast_to(array, (samples, *shape))


def check_values(name: str, array: Array, interface: Interface) -> None:
    """Raise an `InputError` if a value is impossible for the profile with this name.

    `array` is a number, a profile or rows of profiles.
    """
    least, greatest = array.min(), array.max()
    if not (least >= -LARGEST and greatest <= LARGEST):  # also NaN
        entry = tuple(np.argwhere(~(np.abs(array) <= LARGEST))[0].tolist())
        given = f"{array[entry]:g} (at most {LARGEST:g})"
        if name == "strength" and array[entry] == np.inf:
            given += ". Give interface.extent, beyond which nothing breaks, instead"
        raise InputError(f"must be finite. Entry {entry} is {given}")
    given = f"{least:g} {QUANTITIES[name].units}"
    if name in SCALES and least <= 0.0:
        raise InputError(f"must be positive, got {given}")
    if name == "residual_strength" and least < 0.0:
        raise InputError(f"must not be negative, got {given}")
    if name == "normal_pressure":
        means = np.atleast_1d(interface.mean(array) if array.ndim else array)
        if means.min() <= 0.0:
            worst = f"the mean of sample {int(np.argmin(means))} is {means.min():g} Pa"
            raise InputError(f"must be positive on average, but {worst}")


def no_coefficients(values: Array, pressure: Array) -> list[str]:
    """Return why values cannot be friction coefficients here."""
    if np.isnan(pressure).all():
        return [
            "friction_coefficient: needs a normal pressure (load.normal_pressure, Pa, or"
            " load.pressing_force, N)"
        ]
    mean = float(np.mean(values))
    large = (
        f"friction_coefficient: its mean is {mean:.3g}; if that is a strength, state its unit,"
    )
    return [f"{large} as .assign_attrs(units='Pa') does"] * (mean >= FRICTION[1][1])


def named_profiles(given: Any) -> dict[str, Any]:
    """Return profiles by name, from a mapping, a dataset or the strength alone.

    The strength may consist of friction coefficients. Their name or their unit shows
    this.
    """
    if hasattr(given, "marginal") or hasattr(given, "members"):
        raise InputError(
            f"profiles: must be numbers, got a {type(given).__name__}. Pass its sample(interface),"
            " or call st.monte_carlo"
        )
    if not isinstance(given, Mapping):  # a Dataset is one too
        return {"friction_coefficient" if is_coefficient(given) else "strength": given}
    known = (*PROFILES, "friction_coefficient")
    unknown = [
        unknown_name("profiles", str(name), known) for name in given if name not in known
    ]
    if "strength" in given and "friction_coefficient" in given:
        unknown.append("profiles: give either strength (Pa) or friction_coefficient (1)")
    if unknown and not hasattr(given, "data_vars"):
        raise InputError(unknown)
    return {name: given[name] for name in given if name in known}
