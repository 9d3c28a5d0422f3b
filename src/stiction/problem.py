"""The physical problem: two solids, an interface, a friction law and a load."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

import numpy as np
from pydantic import model_validator

from stiction._checks import as_names, is_real
from stiction.errors import InputError, UnitWarning, warn_accuracy, warn_user
from stiction.friction import SCALES, Friction, contradictions
from stiction.interface import Interface
from stiction.load import Load
from stiction.model import Mode, describe, is_unplaced, model
from stiction.placed import on_nodes
from stiction.sample import (
    PROFILES,
    Sample,
    named_profiles,
    profiles_of,
    steepest_rate,
)
from stiction.solid import Solid

# lambda_0 in h_n = 2 lambda_0 G*/W (Uenishi and Rice, 2003).
SMALLEST_EIGENVALUE = 0.5788869418506
FEWEST_NODES = 4
MOST_NODES = 5e4
"""A problem that needs more has a wrong unit rather than a long interface."""
WEAKEST, STRONGEST = 1e-8, 1.0
"""Strength over shear modulus; steel (8e10 Pa) under 10 kPa at a coefficient of 0.1 has 1e-8."""


@model
class Problem:
    """Everything about the interface that is not random.

    Parameters
    ----------
    solid : Solid
    interface : Interface
    friction : LinearWeakening, ExponentialWeakening or PiecewiseWeakening
    load : Load, optional
        Uniform and without initial stress if left out.
    mode : {"II", "III"}
        In-plane or anti-plane shear; a plane is in-plane along x and anti-plane along y.

    Raises
    ------
    InputError
        If an array does not have one entry for each node, the nucleation length spans fewer than
        four nodes, or an interface of two dimensions is given plane stress or mode III.

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
        self._place_profiles()
        shape = self.interface.shape
        friction, load = self.friction, self.load
        arrays = {
            "friction.weakening_rate": friction.weakening_rate,
            "friction.critical_slip": friction.critical_slip,
            "friction.fracture_energy": friction.fracture_energy,
            "friction.residual_strength": friction.residual_strength,
            "friction.residual_ratio": friction.residual_ratio,
            "load.profile": load.profile,
            "load.initial_stress": load.initial_stress,
            "load.normal_pressure": load.normal_pressure,
        }
        nodes = " x ".join(map(str, shape))
        problems = [
            f"{name}: must have one entry for each of the {nodes} nodes, got {describe(value)}"
            + "; x and y have changed places: the first axis of a profile is x"
            * (value.shape == shape[::-1] and len(shape) == 2)
            for name, value in arrays.items()
            if isinstance(value, np.ndarray) and value.shape != shape
        ]
        if self.interface.is_plane:
            if self.solid.plane != "strain":
                problems.append(
                    "solid.plane: on an interface of two dimensions the solids are in three, so"
                    f" there is no plane {self.solid.plane}; leave plane = 'strain'"
                )
            if self.mode != "II":
                problems.append(
                    "mode: on an interface of two dimensions load and slip are along x, which is"
                    f" mode II along x and mode III along y; leave mode = 'II', got {self.mode!r}"
                )
        problems += [f"friction: {text}" for text in contradictions(friction)]
        rate = friction.weakening_rate
        if rate is not None and not problems:
            problems += self._too_few_nodes(float(np.max(rate)))
        if problems:
            raise InputError(problems)
        if rate is not None:
            self._warn_if_short(self.nucleation_length_of(float(np.median(rate))))
        return self

    def _warn_if_short(self, patch: float) -> None:
        length = min(self.interface.lengths)
        if patch >= length:
            warn_user(
                f"the critical patch (nucleation length {patch:.3g} m) fills the interface"
                f" ({length:.3g} m): all of it slides as one; check the units of the length, the"
                " shear modulus and the weakening rate if that is not meant",
                UnitWarning,
            )

    def warn_of_units(self, strength: float, residual: float = 0.0) -> None:
        """Warn if a mean strength (Pa) does not go with the rest of the problem.

        Parameters
        ----------
        strength, residual : float
            Mean peak and residual strength, Pa.
        """
        ratio = strength / self.solid.shear_modulus
        if not WEAKEST <= ratio <= STRONGEST:
            warn_user(
                f"strength: its mean, {strength:.4g} Pa, is {ratio:.2g} of the shear modulus; check"
                " the units of both",
                UnitWarning,
            )
        elif self.friction.weakening_rate is None:  # otherwise warned of with the problem
            scale, value = self.friction.scale
            rate = float(self.friction.rate(np.array(strength - residual), scale, np.median(value)))
            self._warn_if_short(self.nucleation_length_of(max(rate, 1e-300)))

    def _place_profiles(self) -> None:
        """Put profiles with coordinates of their own on the nodes."""
        problems: list[str] = []
        for part in ("friction", "load"):
            owner, placed = getattr(self, part), {}
            for field in dataclasses.fields(owner):
                value = getattr(owner, field.name)
                if is_unplaced(value):
                    try:
                        placed[field.name] = on_nodes(f"{part}.{field.name}", value, self.interface)
                    except InputError as error:
                        problems += error.problems
            if placed and not problems:  # frozen for others; validation is not over yet
                object.__setattr__(self, part, dataclasses.replace(owner, **placed))
        if problems:
            raise InputError(problems)

    @property
    def load_profile(self) -> Any:
        """p of the load: a number, or at the nodes, (*shape)."""
        return self.load.profile_on(self.interface)

    @property
    def effective_modulus(self) -> float:
        """Static modulus G* of the plane state and mode, Pa; on a plane that along x."""
        return self.solid.effective_modulus(self.mode)

    @property
    def nucleation_length(self) -> float:
        """h_n = 2 lambda_0 G*/W, m (Uenishi and Rice, 2003), for a uniform weakening rate.

        Raises
        ------
        InputError
            If the weakening rate varies along the interface or follows from `critical_slip` or
            `fracture_energy`.
        """
        rate = self.uniform_rate
        if rate is None:
            raise InputError(
                "friction.weakening_rate: a nucleation length exists only for a uniform weakening"
                " rate; where it varies, use st.Equilibrium() or st.Rupture()"
            )
        return self.nucleation_length_of(rate)

    @property
    def uniform_rate(self) -> float | None:
        """The problem's weakening rate, Pa/m, if it is the same at all nodes, else None."""
        rate = self.friction.weakening_rate
        return None if rate is None or np.ptp(rate) > 0.0 else float(np.max(rate))

    def nucleation_length_of(self, rate: float) -> float:
        """h_n, m, of a uniform weakening rate in Pa/m."""
        if not (is_real(rate) and rate > 0.0):
            raise InputError(f"rate: must be a positive number, got {describe(rate)}")
        return 2.0 * SMALLEST_EIGENVALUE * self.effective_modulus / rate

    def nodes_in_nucleation_length(self, rate: float) -> float:
        """Nodes that the nucleation length of a weakening rate (Pa/m) spans, where fewest.

        Of a law that steepens with slip the steepest rate counts; on a plane the length across
        the slip, that of mode III, counts as well.
        """
        return min(self._resolution(rate))

    def _resolution(self, rate: float) -> list[float]:
        """The same for each direction."""
        friction, interface = self.friction, self.interface
        steepest = rate * friction.steepest_slope / friction.initial_slope
        unit = 2.0 * SMALLEST_EIGENVALUE / steepest
        moduli = [self.effective_modulus]
        if interface.is_plane:
            moduli.append(self.solid.shear_modulus)
        return [
            unit * modulus / spacing
            for modulus, spacing in zip(moduli, interface.spacings, strict=True)
        ]

    def _too_few_nodes(self, highest_rate: float) -> list[str]:
        resolution = self.nodes_in_nucleation_length(highest_rate)
        if resolution >= FEWEST_NODES:
            return []
        length = self.nucleation_length_of(highest_rate)
        shape = self.interface.shape
        finer = [2.0 * np.ceil(0.5 * FEWEST_NODES * n / max(resolution, 1e-300)) for n in shape]
        enough = " x ".join(f"{n:.10g}" for n in finer)
        doubt = ""
        if max(finer) > MOST_NODES:
            doubt = "; so many suggest that a length, a modulus or a strength has a wrong unit"
        return [
            f"interface.nodes: the nucleation length {length:.3g} m spans {resolution:.2g} nodes;"
            f" at least {FEWEST_NODES} are needed, that is interface.nodes >= {enough},"
            f" got {' x '.join(map(str, shape))}{doubt}"
        ]

    def warn_if_coarse(self, sample: Sample, enough: float, cost: str) -> None:
        """Warn where the nucleation length spans fewer than `enough` nodes; `cost` says what of."""
        resolution = self._resolution(sample.steepest_rate)
        if min(resolution) < enough:
            nodes = f"{resolution[0]:.1f} nodes"
            if self.interface.is_plane:
                nodes = f"{nodes} along x and, in mode III, {resolution[1]:.1f} along y"
            warn_accuracy(
                f"the nucleation length spans {nodes} (better {enough:g} or more): {cost}"
            )

    def sample(self, profiles: Any, *, accept: Collection[str] = ()) -> Sample:
        """What differs between samples, validated, with the problem's own for all the rest.

        Parameters
        ----------
        profiles : array, mapping of arrays, xarray.Dataset or Sample
            Peak strength tau_p (Pa), of shape (samples, *shape) or (*shape); or profiles by name:
            'strength', and any of 'residual_strength', 'initial_stress', 'normal_pressure' (Pa)
            and one of 'weakening_rate' (Pa/m), 'critical_slip' (m) and 'fracture_energy' (J/m²),
            which may also be (samples, 1) or a number and replace the problem's own.
        accept : collection of {"barriers", "overstress", "constant"}
            What the method at hand can do besides: infinite strength where nothing breaks; an
            initial stress above the strength. "constant": the caller has warned of nodes that do
            not weaken.

        Returns
        -------
        Sample

        Raises
        ------
        InputError
            Naming all that is wrong: names, shapes, values that are not finite, strength not above
            the initial stress, or nowhere above the residual strength, a weakening rate that is
            not positive.

        Notes
        -----
        A node whose strength is not above its residual strength does not weaken: its strength is
        constant. An `AccuracyWarning` gives the share of such nodes.
        """
        if isinstance(profiles, Sample):
            return profiles
        accept = as_names("accept", accept)
        given = named_profiles(profiles)
        shape = self.interface.shape
        friction, load = self.friction, self.load
        problems: list[str] = []

        def checked(name: str, own: Any, samples: int | None, infinite: bool = False) -> Any:
            try:
                return profiles_of(name, given.get(name, own), self.interface, samples, infinite)
            except InputError as error:
                problems.extend(error.problems)
                return None

        if "strength" not in given:
            raise InputError("strength: missing among the profiles")
        strength = checked("strength", None, None, "barriers" in accept)
        samples = 1 if strength is None else strength.shape[0]
        along = tuple(range(1, 1 + len(shape)))
        breaks = strength
        if strength is not None:
            stuck = np.isinf(strength).all(axis=along)
            breaks = np.where(np.isinf(strength), 0.0, strength)
            if stuck.any():
                problems.append(
                    f"strength: infinite at every node of sample {int(np.argmax(stuck))}; nothing"
                    " can break"
                )
        own_residual: Any = 0.0 if breaks is None else friction.residual(breaks)
        residual = checked("residual_strength", own_residual, samples)
        initial = checked("initial_stress", load.initial_stress, samples)
        pressure = np.broadcast_to(np.nan, (samples, *shape))
        if load.normal_pressure is not None or "normal_pressure" in given:
            pressure = checked("normal_pressure", load.normal_pressure, samples)
        scales = [name for name in SCALES if name in given]
        if len(scales) > 1:
            problems.append(f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}")
        scale, own_scale = friction.scale
        scale = scales[0] if scales else scale
        value = checked(scale, own_scale, samples)
        if value is not None and value.min() <= 0.0:
            problems.append(
                f"{scale}: must be positive, got {value.min():g} {PROFILES[scale].units}"
            )
        if residual is not None and residual.min() < 0.0:
            problems.append(f"residual_strength: must not be negative, got {residual.min():g} Pa")
        overstressed = strength is not None and initial is not None and np.any(strength <= initial)
        if overstressed and "overstress" not in accept:
            number, *node = np.unravel_index(int(np.argmin(strength - initial)), strength.shape)
            where = (number, *node)
            problems.append(
                f"strength: must be above initial_stress everywhere; sample {number}, node"
                f" {', '.join(map(str, node))}: {strength[where]:g} against {initial[where]:g} Pa;"
                " only st.Rupture() begins above the strength"
            )
        if strength is not None and residual is not None:
            weakens = (strength > residual) & np.isfinite(strength)
            nowhere = np.flatnonzero(~weakens.any(axis=along) & ~stuck)
            if nowhere.size:
                problems.append(
                    f"strength: must be above residual_strength somewhere; sample {nowhere[0]} is"
                    f" nowhere, from {strength[nowhere[0]].min():g} to"
                    f" {strength[nowhere[0]].max():g} Pa: check the units of both"
                )
        if problems:
            raise InputError(problems)
        constant = strength <= residual
        if scale == "weakening_rate":
            rates = value
        else:
            with np.errstate(over="ignore"):  # too short a critical slip is refused just below
                rates = friction.rate(strength - residual, scale, value)
            if np.any(barriers := np.isinf(strength)):  # any rate will do where nothing weakens
                own = np.where(barriers, 0.0, rates).max(axis=along, keepdims=True)
                rates = np.where(barriers, own, rates)
        if constant.any():
            # Residual from the start, tau_r = tau_p: then d_c = 0, and W is of no consequence.
            residual = np.minimum(residual, strength)
            slowest = np.min(rates, axis=along, where=~constant, initial=np.inf, keepdims=True)
            rates = np.where(constant, slowest, rates)
            if "constant" not in accept:
                warn_accuracy(
                    f"strength is not above residual_strength at {100.0 * constant.mean():.2g} %"
                    " of the nodes; these do not weaken: their strength stays as it is"
                )
        too_few = self._too_few_nodes(steepest_rate(strength, residual, rates))
        if too_few:
            raise InputError(too_few)
        profile = np.array(np.broadcast_to(self.load_profile, shape), dtype=np.float64)
        return Sample(strength, residual, rates, initial, profile, pressure)
