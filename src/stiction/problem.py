"""The physical problem: two solids, an interface, a friction law and a load; and its samples."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from pydantic import model_validator

from stiction.arrays import Array
from stiction.errors import InputError, UnitWarning, unknown_name, warn_accuracy, warn_user
from stiction.friction import SCALES, Friction, contradictions
from stiction.friction.parameters import SMALLEST_EIGENVALUE
from stiction.interface import Interface
from stiction.load import Load, LoadShape
from stiction.model import Mode, describe, is_unplaced, model, real_array
from stiction.profiles.placing import describe_gaps, turned
from stiction.profiles.reading import at_nodes
from stiction.results import PROFILES
from stiction.solid import Solid

ACCEPTED = ("barriers", "overstress", "constant")
FEWEST_NODES = 4
LARGEST = 1e100
"""Of a profile, in SI units; sums and products of larger numbers overflow."""
WEAKEST, STRONGEST = 1e-8, 1.0
"""Strength over shear modulus; steel (8e10 Pa) under 10 kPa at a coefficient of 0.1 has 1e-8."""
LEAST_FRICTION, GREATEST_FRICTION = 1e-3, 10.0
"""Mean strength over normal pressure, from superlubricity to adhesive gels."""
BARRIER = 10.0
"""A node is a barrier where tau_p - tau_r is above so many times its lower quartile, of nodes that
weaken."""


def steepest_rate(strength: Array, residual: Array, rate: Array) -> float:
    """Return the largest weakening rate of nodes that may break, Pa/m; arrays (samples, *shape).

    Barriers are left out: with a uniform critical slip they weaken steeply, but never slip.
    """
    drop = strength - residual
    if drop.max() <= BARRIER * drop.min():
        return float(rate.max())
    drop = drop.reshape(drop.shape[0], -1)
    weakens = np.isfinite(drop) & (drop > 0.0)
    typical = np.nanquantile(np.where(weakens, drop, np.nan), 0.25, axis=1)
    return float(rate.reshape(drop.shape)[drop <= BARRIER * typical[:, None]].max())


class Sample(NamedTuple):
    """One interface or many: the profiles that every method starts from.

    A NamedTuple of arrays, so that compiled kernels take it as it is.

    Attributes
    ----------
    strength, residual_strength, weakening_rate, initial_stress : (samples, *shape) arrays
        tau_p, tau_r (Pa), W at zero slip (Pa/m), tau_i (Pa); not to be written to. Without
        the first axis for `one` sample. Strength may be infinite for methods that accept
        barriers. Where it is at or below the residual strength, both are equal and W has
        no effect.
    load_profile : (*shape) array
        p, dimensionless, positive.
    normal_pressure : (samples, *shape) array
        Pa; NaN where the problem has none.
    """

    strength: Array
    residual_strength: Array
    weakening_rate: Array
    initial_stress: Array
    load_profile: Array
    normal_pressure: Array

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
        return Sample(
            self.strength[some], self.residual_strength[some], self.weakening_rate[some],
            self.initial_stress[some], self.load_profile, self.normal_pressure[some],
        )  # fmt: skip

    @property
    def uniform_weakening(self) -> bool:
        """Whether W is the same at all nodes of each sample."""
        flat = self.weakening_rate.reshape(self.samples, -1)
        return bool(np.all(flat == flat[:, :1]))

    @property
    def mean_strength(self) -> float:
        """Mean strength where it is finite, Pa."""
        return float(self.strength.mean(where=np.isfinite(self.strength)))

    @property
    def steepest_rate(self) -> float:
        """Largest weakening rate of nodes that may break, Pa/m."""
        return steepest_rate(self.strength, self.residual_strength, self.weakening_rate)

    def mean_stress(self, load: Array) -> Array:
        """Return <tau_i> + tau_0 <p>, Pa, at the loads tau_0 of shape (samples,)."""
        return self.initial_stress.mean(axis=self.axes) + load * self.load_profile.mean()


@model
class Problem:
    """The deterministic part of a model: solid, interface, friction law and load.

    Parameters
    ----------
    solid : Solid
    interface : Interface
    friction : LinearWeakening, ExponentialWeakening or PiecewiseWeakening
    load : Load, optional
        By default uniform and without initial stress.
    mode : {"II", "III"}
        In-plane or anti-plane shear; a plane is in-plane along x and anti-plane along y.

    Raises
    ------
    InputError
        If an array has another shape than the interface, fewer than four nodes span the
        nucleation length, or another argument is invalid; the message lists every problem.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    ...     interface=st.Interface(length=0.1, nodes=1024),
    ...     friction=st.LinearWeakening(weakening_rate=0.5e12),
    ... )
    >>> round(problem.nucleation_length * 1e3, 3)  # mm
    3.456
    """

    solid: Solid
    interface: Interface
    friction: Friction
    load: Load = Load()
    mode: Mode = "II"

    @model_validator(mode="after")
    def _consistent(self) -> Problem:
        problems = self._place_profiles()
        if isinstance(self.load.profile, LoadShape):
            self.load.profile.on(self.interface)  # refuses one that is not positive
        if self.interface.is_plane and self.solid.plane != "strain":
            problems.append(
                "solid.plane: the solids beside a plane interface are three-dimensional,"
                f" not in plane {self.solid.plane}; leave plane = 'strain'"
            )
        if self.interface.is_plane and self.mode != "II":
            problems.append(
                "mode: on a plane, slip along x is mode II along x and mode III along y;"
                f" leave mode = 'II', got {self.mode!r}"
            )
        problems += [f"friction: {text}" for text in contradictions(self.friction)]
        if problems:
            raise InputError(problems)
        rate = self.friction.weakening_rate
        if rate is not None:
            self._check_resolution(float(np.max(rate)))
            self._warn_if_short(float(np.median(rate)))
        return self

    def _place_profiles(self) -> list[str]:
        """Put profiles with coordinates of their own on the nodes; return what does not fit."""
        problems: list[str] = []
        shape = self.interface.shape
        nodes = " x ".join(map(str, shape))
        for part in ("friction", "load"):
            owner, placed = getattr(self, part), {}
            for name, value in vars(owner).items():
                if isinstance(value, np.ndarray) and value.shape != shape:
                    problems.append(
                        f"{part}.{name}: must have one entry for each of the {nodes} nodes, got"
                        f" {describe(value)}{turned(value.shape, shape)}"
                    )
                if is_unplaced(value):
                    try:
                        at = at_nodes(f"{part}.{name}", value, self.interface)[0]
                        placed[name] = np.asarray(at)
                    except InputError as error:
                        problems += error.problems
            if placed and not problems:  # frozen for others; validation is not over yet
                object.__setattr__(self, part, dataclasses.replace(owner, **placed))
        return problems

    def _warn_if_short(self, rate: float) -> None:
        patch, length = self.nucleation_lengths(rate)[0], min(self.interface.lengths)
        if patch >= length:
            warn_user(
                f"the critical patch (nucleation length {patch:.3g} m) fills the interface"
                f" ({length:.3g} m), which slides as a whole; if this is not intended, check"
                " the units of the length, the shear modulus and the weakening rate",
                UnitWarning,
            )

    def warn_of_units(self, strength: float, residual: float = 0.0) -> None:
        """Warn if mean peak and residual strengths (Pa) do not fit the rest of the problem."""
        ratio, pressure = strength / self.solid.shear_modulus, self.load.normal_pressure
        coefficient = 1.0 if pressure is None else float(strength / np.mean(pressure))
        if not WEAKEST <= ratio <= STRONGEST:
            hint = ", and give coefficients as of='friction_coefficient'"
            warn_user(
                f"strength: its mean, {strength:.4g} Pa, is {ratio:.2g} of the shear modulus; check"
                f" the units of both{hint * (0.0 < strength < 10.0 and pressure is not None)}",
                UnitWarning,
            )
        elif not LEAST_FRICTION <= coefficient <= GREATEST_FRICTION:
            warn_user(
                f"strength: its mean, {strength:.4g} Pa, is {coefficient:.2g} of the normal"
                " pressure; check the units of both, and that friction coefficients are no"
                " percentages",
                UnitWarning,
            )
        elif 0.0 < residual < WEAKEST * self.solid.shear_modulus:
            warn_user(
                f"residual_strength: its mean, {residual:.4g} Pa, is"
                f" {residual / strength:.2g} of that of the strength; check the units of both",
                UnitWarning,
            )
        elif self.friction.weakening_rate is None:  # otherwise warned of with the problem
            (scale, value), drop = self.friction.scale, np.array(strength - residual)
            rate = float(self.friction.rate(drop, scale, np.median(value)))
            self._warn_if_short(max(rate, 1e-300))

    @property
    def load_profile(self) -> Any:
        """Load profile p: a number, or an array at the nodes, (*shape)."""
        profile = self.load.profile
        return profile.on(self.interface) if isinstance(profile, LoadShape) else profile

    @property
    def effective_modulus(self) -> float:
        """Static modulus G* of the plane state and mode, Pa; on a plane that along x."""
        return self.solid.effective_modulus(self.mode)

    @property
    def uniform_rate(self) -> float | None:
        """The problem's weakening rate, Pa/m, if it is the same at all nodes, else None."""
        rate = self.friction.weakening_rate
        return None if rate is None or np.ptp(rate) > 0.0 else float(np.max(rate))

    @property
    def nucleation_length(self) -> float:
        """h_n = 2 lambda_0 G*/W, m (Uenishi and Rice, 2003), of a uniform weakening rate.

        It raises an `InputError` if the rate varies along the interface or follows from
        other parameters.
        """
        if self.uniform_rate is None:
            raise InputError(
                "friction.weakening_rate: a nucleation length needs a uniform one; give"
                " weakening_rate, about (strength - residual_strength)/critical_slip, or use"
                " st.Equilibrium() or st.Rupture(), which need none"
            )
        return self.nucleation_lengths(self.uniform_rate)[0]

    def nucleation_lengths(self, rate: float) -> tuple[float, ...]:
        """Return h_n of a uniform weakening rate (Pa/m) in each direction, m.

        On a plane, the length along x is that of mode II, along y that of mode III.
        """
        if not rate > 0.0:
            raise InputError(f"rate: must be a positive number, got {describe(rate)}")
        moduli = (self.effective_modulus, self.solid.shear_modulus)[: len(self.interface.shape)]
        return tuple(2.0 * SMALLEST_EIGENVALUE * modulus / rate for modulus in moduli)

    def nodes_in_nucleation_length(self, rate: float) -> tuple[float, ...]:
        """Return how many nodes the nucleation length of a weakening rate (Pa/m) spans.

        It returns one number per direction. If the law steepens, the steepest rate counts.
        """
        steepest = rate * self.friction.steepest_slope / self.friction.initial_slope
        lengths = zip(self.nucleation_lengths(steepest), self.interface.spacings, strict=True)
        return tuple(length / spacing for length, spacing in lengths)

    def _check_resolution(self, highest_rate: float) -> None:
        resolutions = self.nodes_in_nucleation_length(highest_rate)
        resolution, shape = min(resolutions), self.interface.shape
        if resolution < FEWEST_NODES:
            length = self.nucleation_lengths(highest_rate)[resolutions.index(resolution)]
            finer = 2.0 * np.ceil(
                0.5 * FEWEST_NODES * np.array(shape) / max(resolution, 1e-300)
            )
            raise InputError(
                f"interface.nodes: the nucleation length {length:.3g} m spans {resolution:.2g}"
                f" nodes; at least {FEWEST_NODES} are needed, that is interface.nodes >="
                f" {' x '.join(f'{n:.10g}' for n in finer)}, got {' x '.join(map(str, shape))};"
                " if that is far off, check the units of all lengths, moduli and strengths"
            )

    def warn_if_coarse(self, sample: Sample, enough: float, cost: str) -> None:
        """Warn with the error `cost` if h_n spans fewer than `enough` nodes."""
        resolution = self.nodes_in_nucleation_length(sample.steepest_rate)
        if min(resolution) < enough:
            nodes = f"{resolution[0]:.1f} nodes"
            if self.interface.is_plane:
                nodes = f"{nodes} along x and, in mode III, {resolution[1]:.1f} along y"
            wanted = 16 if enough <= 12.0 else 32
            finer = np.ceil(
                0.5 * np.array(self.interface.shape) * wanted / np.array(resolution)
            )
            warn_accuracy(
                f"the nucleation length spans {nodes}; {wanted} are recommended"
                f" (interface.nodes = {' x '.join(f'{2 * n:g}' for n in finer)}): {cost}"
            )

    def sample(self, profiles: Any, *, accept: Collection[str] = ()) -> Sample:
        """Return the validated profiles of samples, with the problem's own values for all others.

        Parameters
        ----------
        profiles : array, mapping of arrays, xarray.Dataset or Sample
            Peak strength tau_p (Pa), of shape (samples, *shape) or (*shape); or profiles by
            name: 'strength' and any others of `PROFILES`, but only one of 'weakening_rate',
            'critical_slip' and 'fracture_energy'. A profile replaces the problem's own, and
            may also be (samples, 1) or a number.
        accept : collection of {"barriers", "overstress", "constant"}
            What the method accepts: infinite strength where nothing breaks; an initial
            stress above the strength. "constant": the caller has warned of nodes that do
            not weaken.

        Raises
        ------
        InputError
            If a name, shape or value is invalid, a strength is not above the initial stress,
            or no strength is above the residual strength; the message lists every problem.

        Notes
        -----
        A node whose strength is not above its residual strength does not weaken: its strength is
        constant. An `AccuracyWarning` gives the share of such nodes.
        """
        if isinstance(profiles, Sample):
            return profiles
        if not isinstance(accept, Collection) or any(one not in ACCEPTED for one in accept):
            names = ", ".join(map(repr, ACCEPTED))
            raise InputError(f"accept: must be a collection of {names}, got {accept!r}")
        given, problems = named_profiles(profiles), []
        friction, load, interface = self.friction, self.load, self.interface
        scales = [name for name in SCALES if name in given]
        if len(scales) > 1:
            problems.append(f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}")

        def checked(name: str, own: Any, samples: int | None, infinite: bool = False) -> Any:
            try:
                return profiles_of(name, given.get(name, own), interface, samples, infinite)
            except InputError as error:
                problems.extend(error.problems)
                return np.ones(1)

        if "strength" not in given:
            raise InputError("strength: missing among the profiles")
        strength = checked("strength", None, None, "barriers" in accept)
        samples = len(strength)
        residual = friction.residual(np.where(np.isinf(strength), 0.0, strength))
        residual = checked("residual_strength", residual, samples)
        initial = checked("initial_stress", load.initial_stress, samples)
        pressure = np.broadcast_to(np.nan, (samples, *interface.shape))
        if load.normal_pressure is not None or "normal_pressure" in given:
            pressure = checked("normal_pressure", load.normal_pressure, samples)
        scale, own_scale = friction.scale
        scale = scales[0] if scales else scale
        value = checked(scale, own_scale, samples)
        problems = problems or self._impossible(strength, residual, initial, accept)
        if problems:
            raise InputError(problems)
        rates = self._rates(strength, residual, scale, value)
        constant = strength <= residual
        if constant.any():
            # Residual from the start, tau_r = tau_p: then d_c = 0, and W is of no consequence.
            residual = np.minimum(residual, strength)
            along = interface.axes
            slowest = np.min(rates, axis=along, where=~constant, initial=np.inf, keepdims=True)
            rates = np.where(constant, slowest, rates)
            if "constant" not in accept:
                warn_accuracy(
                    f"strength is not above residual_strength at {100.0 * constant.mean():.2g}"
                    " % of the nodes; these do not weaken: their strength is constant"
                )
        self._check_resolution(steepest_rate(strength, residual, rates))
        load_shape = np.array(np.broadcast_to(self.load_profile, interface.shape), dtype=float)
        return Sample(strength, residual, rates, initial, load_shape, pressure)

    def _impossible(
        self, strength: Array, residual: Array, initial: Array, accept: Collection[str]
    ) -> list[str]:
        """Return what is wrong with profiles that are in order one by one."""
        along, problems = self.interface.axes, []
        if "overstress" not in accept and np.any(strength <= initial):
            where = np.unravel_index(int(np.argmin(strength - initial)), strength.shape)
            node = ", ".join(map(str, where[1:]))
            problems.append(
                f"strength: must be above initial_stress everywhere; sample {where[0]},"
                f" node {node}: {strength[where]:g} against {initial[where]:g} Pa; only"
                " st.Rupture() accepts stress above the strength"
            )
        nowhere = ~((strength > residual) & np.isfinite(strength)).any(axis=along)
        if nowhere.any():
            number = int(np.argmax(nowhere))
            least, most = strength[number].min(), strength[number].max()
            lower = np.broadcast_to(residual, strength.shape)[number]
            problems.append(
                "strength: must be finite and above residual_strength at one node or more; in"
                f" sample {number} strength is {least:g} to {most:g} Pa and residual_strength"
                f" {lower.min():g} to {lower.max():g} Pa: check the units of both"
            )
        return problems

    def _rates(self, strength: Array, residual: Array, scale: str, value: Array) -> Array:
        """Weakening rates, Pa/m, from whichever scale of slip is given."""
        rates = self.friction.rate(strength - residual, scale, value)
        barriers = np.isinf(strength)
        if barriers.any() and scale != "weakening_rate":  # any rate will do: nothing weakens
            along = self.interface.axes
            own = np.where(barriers, 0.0, rates).max(axis=along, keepdims=True)
            rates = np.where(barriers, own, rates)
        return rates


def profiles_of(
    name: str,
    value: Any,
    interface: Interface,
    samples: int | None = None,
    infinite: bool = False,
) -> Array:
    """Return `value` as a (samples, *shape) float64 array, or raise an `InputError` naming it.

    A single profile (*shape) is one sample; where `samples` is given, a number, a profile
    or one number a sample, of shape (samples, 1), is broadcast to all. Of labelled arrays
    the names of dimensions, the coordinates and the units decide. Positive infinity passes
    if `infinite`.
    """
    shape = interface.shape
    nodes = ", ".join(map(str, shape))
    valid = f"({samples or 'samples'}, {nodes}) or ({nodes}{',' if len(shape) == 1 else ''})"
    if samples is not None:
        valid += f", ({samples}, 1) or a number"
    try:
        array = real_array(at_nodes(name, value, interface)[0])
    except TypeError as error:
        raise InputError(f"{name}: must be numbers of shape {valid}; {error}") from None
    if array.shape == (*shape, 1) and samples != shape[0]:  # a column, as out of a table
        array = array[..., 0]
    column = (samples or 0, *(1 for _ in shape))
    if array.shape == (samples, 1):
        array = array.reshape(column)
    several = array.shape[1:] == shape and samples in (None, len(array))
    broadcast = samples is not None and array.shape in ((), column)
    if not (array.shape == shape or several or broadcast):
        hint = turned(array.shape[-2:], shape)
        raise InputError(f"{name}: must have shape {valid}, got shape {array.shape}{hint}")
    if array.size == 0:
        raise InputError(f"{name}: has no samples, shape {array.shape}")
    _check_values(name, array, interface, infinite)
    if samples is not None:
        return np.broadcast_to(array, (samples, *shape))
    return array[None] if array.shape == shape else array


def _check_values(name: str, array: Array, interface: Interface, infinite: bool) -> None:
    bad = ~(np.abs(array) <= LARGEST) & ~(infinite & (array == np.inf))
    missing = np.isnan(array)
    if missing.any() and array.shape[-len(interface.shape) :] == interface.shape:
        raise InputError(
            f"{name}: {describe_gaps(missing, interface)}; gaps='fill' of st.onset and"
            " st.read_profile fills them with straight lines"
        )
    if bad.any():
        entry = tuple(int(i) for i in np.argwhere(np.atleast_1d(bad))[0])
        raise InputError(f"{name}: must be finite; entry {entry} is not, or beyond {LARGEST:g}")
    least = f"{array.min():g} {PROFILES[name].units}"
    if name in SCALES and array.min() <= 0.0:
        raise InputError(f"{name}: must be positive, got {least}")
    if name == "residual_strength" and array.min() < 0.0:
        raise InputError(f"{name}: must not be negative, got {least}")


def named_profiles(given: Any) -> dict[str, Any]:
    """Return profiles by name: of a mapping or dataset, or of the strength alone."""
    if isinstance(given, Mapping):  # a Dataset is one too
        names = [str(name) for name in given]
        unknown = [name for name in names if name not in PROFILES]
        if unknown and not hasattr(given, "data_vars"):
            raise InputError([unknown_name("profiles", name, PROFILES) for name in unknown])
        return {name: given[name] for name in names if name in PROFILES}
    return {"strength": given}


def refusals(problem: Problem, method: Any) -> list[str]:
    """Return why a method does not take a problem; no texts if it does."""
    return [
        f"method: the {method.label} cannot take this: {reason}"
        for reason in method.supports(problem)
    ]
