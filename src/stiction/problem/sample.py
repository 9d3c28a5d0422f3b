"""The profiles of samples, and the way of users' data to a sample.

`placed_sample` takes labelled or plain arrays. `own_sample` takes
arrays that the package made, which need steps 4 and 5 only.

1. Name the profiles (`named_profiles`).
2. Convert labelled values to SI (`reading/labels.py`).
3. Put the values on the nodes (`profiles.py`), as rows
   (samples, *shape).
4. Check the values, and that each is given once (`check_values`,
   `given_twice`).
5. Fill in what the problem gives, check that the profiles fit together,
   and return a `Sample` (`_made`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, unknown_name, warn_accuracy
from stiction.base.model import as_numbers
from stiction.base.representation import Result, Row, Summary
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.problem.friction import SCALES
from stiction.problem.interface import Interface
from stiction.problem.profiles import at_nodes, turned
from stiction.problem.reading.labels import is_coefficient
from stiction.problem.resolution import check_resolution
from stiction.problem.specimen import Slider

MAX_STRENGTH_RATIO = 1e8
"""Strength of a node over the median beyond which others are lost in round-off."""
BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, by rank, of
nodes that weaken."""

STRENGTHS = ("strength", "residual_strength")
"""Profiles that a slider takes as friction coefficients only."""
COEFFICIENTS = (
    "a slider takes friction coefficients instead of stresses. Give a DataArray with the unit 1"
)
"""Advice for strengths of a slider."""
NO_INITIAL_STRESS = "follows from the pressing of a slider. Leave it out"
GIVE_PRESSURE = "Give load.normal_pressure (Pa) or load.pressing_force (N)"
REPLACED = {
    "residual_strength": ("friction.residual_strength", "friction.residual_ratio"),
    "initial_stress": ("load.initial_stress",),
    "normal_pressure": ("load.normal_pressure", "load.pressing_force"),
    **dict.fromkeys(SCALES, tuple(f"friction.{name}" for name in SCALES)),
}
"""Parameters that a profile, or a random property, of each name would replace."""


FRICTION = (1e-3, 10.0), (1e-4, 100.0)
"""Usual and possible mean strengths over normal pressure, from superlubricity to adhesive gels."""
LARGEST = 1e100
"""Of a profile, in SI units; sums and products of larger numbers overflow."""


def steepest_weakening_rate(strength: Array, residual: Array, weakening_rate: Array) -> float:
    """Return the largest of some weakening rates, Pa/m, among nodes that may break.

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
        """Largest weakening rate at any slip, Pa/m, among nodes that may break.

        A sample without a problem has a law that does not steepen.
        """
        W = self.weakening_rate
        steepest = steepest_weakening_rate(self.strength, self.residual_strength, W)
        return steepest if self.problem is None else steepest * self.problem.friction.steepening

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


def named_profiles(given: Any) -> dict[str, Any]:
    """Return profiles by name, from a mapping, a dataset or the strength alone.

    The strength may consist of friction coefficients. Their name or
    their unit shows this.
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
    profiles = {name: given[name] for name in given if name in known}
    if is_coefficient(profiles.get("strength")):
        profiles["friction_coefficient"] = profiles.pop("strength")
    return profiles


def placed_sample(problem: Any, profiles: Any, accept: Collection[str] = ()) -> Sample:
    """Return a sample made from users' data. See `Problem.sample` for the arguments.

    Each of the steps 1 to 5 of this file returns a new value.
    """
    if isinstance(profiles, Sample):
        sample = own_sample(problem, _given_again(problem, profiles), accept)
    else:
        # 1. Names.
        given = named_profiles(profiles)
        coefficients = [name for name in STRENGTHS if is_coefficient(given.get(name))]
        # 2. and 3. SI, and nodes.
        rows, mistakes = _at_nodes_by_name(given, problem.interface, pressing_of(problem))
        # 4. Checks.
        mistakes = given_twice(problem, given, "profiles") + mistakes
        if isinstance(problem.specimen, Slider):
            stresses = {*STRENGTHS} & {*given} - {*coefficients}
            mistakes += [f"{name}: {COEFFICIENTS}" for name in sorted(stresses)]
            if "initial_stress" in given:
                mistakes.append(f"initial_stress: {NO_INITIAL_STRESS}")
        if mistakes:
            raise InputError(mistakes)
        # 5. Coefficients become stresses, and profiles a sample.
        pressure = rows.get("normal_pressure", problem.normal_pressure)
        for name in coefficients:
            rows[name] = rows[name] * pressure
        if "friction_coefficient" in rows:
            rows["strength"] = rows.pop("friction_coefficient") * pressure
        sample = _made(problem, rows, accept)
        if (constant := sample.strength <= sample.residual_strength).any():
            warn_accuracy(
                f"strength is not above residual_strength at {100.0 * constant.mean():.2g} % of"
                " the nodes. These do not weaken: their strength is constant"
            )
    check_resolution(problem, sample.steepest_weakening_rate)
    return sample


def _at_nodes_by_name(
    given: Mapping[str, Any], interface: Interface, pressing: Any
) -> tuple[dict[str, Array], list[str]]:
    """Return users' profiles by name as (samples, *shape), and the mistakes in them.

    A profile with a mistake is missing in the result. A pressure
    without values along the interface is a mean, which is multiplied by
    `pressing`.
    """
    first = "strength" if "strength" in given else "friction_coefficient"
    if first not in given:
        raise InputError("strength: missing among the profiles")
    rows: dict[str, Array] = {}
    scales = [name for name in SCALES if name in given]
    problems = [f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}"] * (
        len(scales) > 1
    )
    samples = None
    for name in (first, *(name for name in given if name != first)):
        try:
            of_friction = name == "residual_strength" and is_coefficient(given[name])
            quantity = "friction_coefficient" if of_friction else name
            value = at_nodes(quantity, given[name], interface)
            with prefixed(name):
                rows[name] = _rows_of(quantity, value, interface, samples)
            if name == "normal_pressure" and np.shape(value) in ((), (samples, 1)):
                rows[name] = rows[name] * pressing
        except InputError as error:
            problems += error.problems
        if name == first:
            samples = len(rows[first]) if first in rows else 1
    return rows, problems


def pressing_of(problem: Any) -> Any:
    """Return the pressure at the nodes over the given pressure: 1, or (nodes,) if glued."""
    glued = problem.specimen is not None and problem.specimen.pressing == "glued"
    return problem.blocks.pressure if glued else 1.0


def constants_of(problem: Any, strength: Any) -> dict[str, Any]:
    """Return, by name, values for profiles that are not given, or None without a value."""
    return {
        "residual_strength": problem.friction.residual(strength),
        "initial_stress": problem.load.initial_stress,
        **dict([problem.friction.scale] if problem.friction.scale else []),
        "normal_pressure": problem.normal_pressure,
    }


def own_sample(
    problem: Any, profiles: Mapping[str, Array], accept: Collection[str] = ()
) -> Sample:
    """Return a sample from arrays by name that the package made. They are in SI units.

    Only values are checked here, because some samples may not fit
    the problem. The caller checks the resolution, and the nodes
    that do not weaken, for all samples together.
    """
    problems: list[str] = []
    for name, rows in profiles.items():
        try:
            with prefixed(name):
                check_values(name, rows, problem.interface)
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return _made(problem, profiles, accept)


def _made(problem: Any, profiles: Mapping[str, Array], accept: Collection[str]) -> Sample:
    """Return a sample from arrays with valid values, if they fit together.

    Profiles that are not given come from the problem.
    """
    interface, strength = problem.interface, profiles["strength"]
    constants = constants_of(problem, strength)
    # A given profile replaces the value in the problem, so its
    # scale comes first.
    scale = next(name for name in (*profiles, *constants) if name in SCALES)
    known = constants | dict(profiles)
    if known["normal_pressure"] is None:
        known["normal_pressure"] = np.nan
    residual, initial, value, pressure = (
        np.broadcast_to(known[name], strength.shape)
        for name in ("residual_strength", "initial_stress", scale, "normal_pressure")
    )
    # Nodes beyond the extent never break.
    barriers = ~interface.breakable
    if interface.is_held:
        strength = np.where(barriers, np.inf, strength)
    overstress = "overstress" in accept
    if problems := contradictions_of(interface, strength, residual, initial, overstress):
        raise InputError(problems)
    drop = strength - residual
    if isinstance(problem.specimen, Slider):
        if np.ptp(pressure, axis=-1).any():
            raise InputError("normal_pressure: follows from the rig. Give its mean")
        mu, mu_r = strength / pressure, residual / pressure
        drop = drop * problem.specimen.checked_pressing(
            problem.rig, interface.measure, mu, mu_r
        )
    W = problem.friction.weakening_rate_of(drop, scale, value)
    if interface.is_held and scale != "weakening_rate":
        # Barriers never weaken. Any finite rate will do, and here
        # it is the fastest.
        fastest = np.where(barriers, 0.0, W).max(interface.axes, keepdims=True)
        W = np.where(barriers, fastest, W)
    constant = strength <= residual
    if constant.any():
        # Residual from the start, tau_r = tau_p: then d_c = 0, and
        # W is of no consequence.
        residual = np.minimum(residual, strength)
        slowest = np.min(W, axis=interface.axes, where=~constant, initial=np.inf, keepdims=True)
        W = np.where(constant, slowest, W)
    if initial.min() < 0.0 and (reversed_at := initial < -strength).any():
        warn_accuracy(
            f"initial_stress is below minus the strength at {100.0 * reversed_at.mean():.2g} %"
            " of the nodes. Reverse slip is not modelled, so these nodes are held"
        )
    load_profile = np.array(np.broadcast_to(problem.load_profile, interface.shape), dtype=float)
    return Sample(strength, residual, W, initial, load_profile, pressure, problem)


def given_twice(problem: Any, names: Collection[str], owner: str) -> list[str]:
    """Return messages about values that profiles or random properties would replace.

    There are also messages about values that are given in neither
    place. In the messages, `owner` stands before the names.
    """
    twice = [
        f"problem.{key}: has no effect together with {owner}.{name}. Leave either out"
        for name in names
        for key in REPLACED.get(name, ())
        if (value := attrgetter(key)(problem)) is not None and np.any(value)
    ]
    if problem.friction.scale is None and not {*SCALES} & {*names}:
        twice.append(
            f"problem.friction: give one of {', '.join(SCALES)}, or {owner}.{SCALES[0]} and so"
            " on where it varies from sample to sample. Got none"
        )
    pressed = problem.given_pressure is not None or "normal_pressure" in names
    if "friction_coefficient" in names and not pressed:
        twice.append(f"friction_coefficient: needs a normal pressure. {GIVE_PRESSURE}")
    if isinstance(problem.specimen, Slider) and not pressed:
        twice.append(f"load: a slider needs a normal force. {GIVE_PRESSURE}")
    if problem.specimen is not None and problem.specimen.pressing == "glued" and not pressed:
        text = "'glued' has no effect without a normal pressure"
        twice.append(f"problem.specimen.pressing: {text}. {GIVE_PRESSURE}")
    return twice


def _given_again(problem: Any, sample: Sample) -> dict[str, Array]:
    """Return the profiles of a given `Sample` by name, or refuse a foreign sample."""
    if sample.shape != problem.interface.shape:
        shapes = f"shape {sample.shape}, the interface {problem.interface.shape}"
        raise InputError(f"profiles: the sample has {shapes}")
    alike = np.allclose(sample.load_profile, problem.load_profile, rtol=1e-6)
    if not alike or sample.problem not in (None, problem):
        raise InputError("profiles: the sample was made by another problem. Make it anew")
    given = {name: rows for name, rows in sample._asdict().items() if name in PROFILES}
    given["strength"] = np.where(np.isinf(sample.strength), 1.0, sample.strength)
    if np.isnan(sample.normal_pressure).all():
        del given["normal_pressure"]
    return given


def _rows_of(name: str, value: Any, interface: Interface, samples: int | None) -> Array:
    """Return `value` as a (samples, *shape) float64 array, or raise an `InputError`.

    A single profile (*shape) counts as one sample. If `samples` is
    given, a number, a profile, or one number per sample with shape
    (samples, 1) is broadcast to (samples, *shape).
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
    if name == "friction_coefficient" and array.mean() >= FRICTION[1][1]:
        raise InputError(
            f"its mean is {array.mean():.3g}; if that is a strength, state its unit, as"
            " .assign_attrs(units='Pa') does"
        )
    if name == "residual_strength" and least < 0.0:
        raise InputError(f"must not be negative, got {given}")
    if name == "normal_pressure":
        means = np.atleast_1d(interface.mean(array) if array.ndim else array)
        if means.min() <= 0.0:
            worst = f"the mean of sample {int(np.argmin(means))} is {means.min():g} Pa"
            raise InputError(f"must be positive on average, but {worst}")
