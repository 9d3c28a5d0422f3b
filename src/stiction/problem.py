"""The physical problem: two solids, an interface, a friction law and a load."""

from __future__ import annotations

import dataclasses
from collections.abc import Collection
from typing import Any

import numpy as np
from pydantic import model_validator

from stiction._checks import is_real
from stiction._model import Mode, describe, model
from stiction.errors import InputError, warn_accuracy
from stiction.friction import SlipWeakening
from stiction.interface import Interface
from stiction.load import Load
from stiction.placed import Placed
from stiction.plausible import MOST_NODES, suspects, warn_of_length
from stiction.rows import Rows, as_rows, mean_strength, steepest_rate
from stiction.solid import Solid

# lambda_0 in h_n = 2 lambda_0 G*/W (Uenishi and Rice, 2003).
SMALLEST_EIGENVALUE = 0.5788869418506
FEWEST_NODES = 4


@model
class Problem:
    """Everything about the interface that is not random.

    Parameters
    ----------
    solid : Solid
    interface : Interface
    friction : SlipWeakening
    load : Load, optional
        Uniform and without initial stress if left out.
    mode : {"II", "III"}
        In-plane or anti-plane shear.

    Raises
    ------
    InputError
        If an array does not have one entry for each node, or the nucleation length spans fewer
        than four nodes.
    """

    solid: Solid
    interface: Interface
    friction: SlipWeakening
    load: Load = Load()
    mode: Mode = "II"

    @model_validator(mode="after")
    def _consistent(self) -> Problem:
        nodes = self.interface.nodes
        self._place_profiles()
        arrays = {
            "friction.weakening_rate": self.friction.weakening_rate,
            "friction.critical_slip": self.friction.critical_slip,
            "friction.residual_strength": self.friction.residual_strength,
            "load.profile": self.load.profile,
            "load.initial_stress": self.load.initial_stress,
            "load.normal_pressure": self.load.normal_pressure,
        }
        problems = [
            f"{name}: must have one entry for each of the {nodes} nodes, got {describe(value)}"
            for name, value in arrays.items()
            if isinstance(value, np.ndarray) and value.shape != (nodes,)
        ]
        rate = self.friction.weakening_rate
        if rate is not None and not problems:
            problems += self._too_few_nodes(float(np.max(rate)))
        if problems:
            raise InputError(problems)
        if rate is not None:
            warn_of_length(self, self.nucleation_length_of(float(np.median(rate))))
        return self

    def _place_profiles(self) -> None:
        """Put profiles with coordinates of their own on the nodes."""
        problems: list[str] = []
        for part in ("friction", "load"):
            owner, placed = getattr(self, part), {}
            for field in dataclasses.fields(owner):
                value = getattr(owner, field.name)
                if isinstance(value, Placed):
                    try:
                        placed[field.name] = value.on(self.interface)
                    except InputError as error:
                        problems += [f"{part}.{field.name}: {text}" for text in error.problems]
            if placed and not problems:  # frozen for others; validation is not over yet
                object.__setattr__(self, part, dataclasses.replace(owner, **placed))
        if problems:
            raise InputError(problems)

    @property
    def effective_modulus(self) -> float:
        """Static modulus G* of the plane state and mode, Pa."""
        return self.solid.effective_modulus(self.mode)

    @property
    def nucleation_length(self) -> float:
        """h_n = 2 lambda_0 G*/W, m (Uenishi and Rice, 2003), for a uniform weakening rate.

        Raises
        ------
        InputError
            If the weakening rate varies along the interface or follows from `critical_slip`.
        """
        rate = self.friction.weakening_rate
        if rate is None or np.ptp(rate) > 0.0:
            raise InputError(
                "friction.weakening_rate: a nucleation length exists only for a uniform weakening"
                " rate; where it varies, use st.Equilibrium() or st.Rupture()"
            )
        return self.nucleation_length_of(float(np.max(rate)))

    def nucleation_length_of(self, rate: float) -> float:
        """h_n, m, of a uniform weakening rate in Pa/m."""
        if not (is_real(rate) and rate > 0.0):
            raise InputError(f"rate: must be a positive number, got {describe(rate)}")
        return 2.0 * SMALLEST_EIGENVALUE * self.effective_modulus / rate

    def _too_few_nodes(self, steepest_rate: float, strength: float | None = None) -> list[str]:
        length = self.nucleation_length_of(steepest_rate)
        resolution = length / self.interface.spacing
        if resolution >= FEWEST_NODES:
            return []
        enough = 2.0 * np.ceil(0.5 * FEWEST_NODES * self.interface.length / max(length, 1e-300))
        doubt = ""
        if enough > MOST_NODES:
            likely = suspects(self, self.interface.length / max(length, 1e-300), strength)
            doubt = f"; so many suggest a wrong unit{', perhaps ' * bool(likely)}{likely}"
        return [
            f"interface.nodes: the nucleation length {length:.3g} m spans {resolution:.2g} nodes;"
            f" at least {FEWEST_NODES} are needed, that is interface.nodes >= {enough:.10g},"
            f" got {self.interface.nodes}{doubt}"
        ]

    def warn_if_coarse(self, rows: Rows, enough: float, cost: str) -> None:
        """Warn where the nucleation length spans fewer than `enough` nodes; `cost` says what of."""
        resolution = self.nucleation_length_of(rows.steepest_rate) / rows.spacing
        if resolution < enough:
            warn_accuracy(
                f"the nucleation length spans {resolution:.1f} nodes (better {enough:g} or more):"
                f" {cost}"
            )

    def rows(
        self,
        tau_p: Any,
        *,
        residual_strength: Any = None,
        initial_stress: Any = None,
        weakening_rate: Any = None,
        accept: Collection[str] = (),
    ) -> Rows:
        """Strength profiles and what else varies between samples, validated and broadcast.

        Parameters
        ----------
        tau_p : (samples, nodes) or (nodes,) array
            Peak strength, Pa.
        residual_strength, initial_stress, weakening_rate : array, optional
            Where given, replaces the problem's own: (samples, nodes), (nodes,), (samples, 1) or a
            number.
        accept : collection of {"barriers", "overstress", "constant"}
            What the method at hand can do besides: infinite strength where nothing breaks; an
            initial stress above the strength. "constant": the caller has warned of nodes that do
            not weaken.

        Raises
        ------
        InputError
            Naming all that is wrong: shapes, values that are not finite, strength not above the
            initial stress, or nowhere above the residual strength, a weakening rate that is not
            positive.

        Notes
        -----
        A node whose strength is not above its residual strength does not weaken: its strength is
        constant. An `AccuracyWarning` gives the share of such nodes.
        """
        nodes = self.interface.nodes
        problems: list[str] = []

        def checked(
            name: str, given: Any, own: Any, count: int | None, infinite: bool = False
        ) -> Any:
            quantity = "strength" if name == "tau_p" else name
            value = own if given is None else given
            try:
                return as_rows(name, value, quantity, self.interface, count, infinite)
            except InputError as error:
                problems.extend(error.problems)
                return None

        strength = checked("tau_p", tau_p, None, None, "barriers" in accept)
        count = 1 if strength is None else strength.shape[0]
        stuck = np.zeros(1, dtype=bool) if strength is None else np.isinf(strength).all(axis=1)
        if stuck.any():
            problems.append(
                f"tau_p: infinite at every node of sample {int(np.argmax(stuck))}; nothing can"
                " break"
            )
        residual = checked(
            "residual_strength", residual_strength, self.friction.residual_strength, count
        )
        initial = checked("initial_stress", initial_stress, self.load.initial_stress, count)
        own_rate = self.friction.weakening_rate
        rates = None
        if weakening_rate is not None or own_rate is not None:
            rates = checked("weakening_rate", weakening_rate, own_rate, count)
            if rates is not None and rates.min() <= 0.0:
                problems.append(f"weakening_rate: must be positive, got {rates.min():g} Pa/m")
        if residual is not None and residual.min() < 0.0:
            problems.append(f"residual_strength: must not be negative, got {residual.min():g} Pa")
        overstressed = strength is not None and initial is not None and np.any(strength <= initial)
        if overstressed and "overstress" not in accept:
            sample, node = np.unravel_index(int(np.argmin(strength - initial)), strength.shape)
            problems.append(
                f"tau_p: must be above initial_stress everywhere; sample {sample}, node {node}:"
                f" {strength[sample, node]:g} against {initial[sample, node]:g} Pa; only"
                " st.Rupture() begins above the strength"
            )
        if strength is not None and residual is not None:
            weakens = (strength > residual) & np.isfinite(strength)
            nowhere = np.flatnonzero(~weakens.any(axis=1) & ~stuck)
            if nowhere.size:
                problems.append(
                    f"tau_p: must be above residual_strength somewhere; sample {nowhere[0]} is"
                    f" nowhere, from {strength[nowhere[0]].min():g} to"
                    f" {strength[nowhere[0]].max():g} Pa: check the units of both"
                )
        if problems:
            raise InputError(problems)
        constant = strength <= residual
        if rates is None:
            with np.errstate(over="ignore"):  # too short a critical slip is refused just below
                rates = (strength - residual) / np.asarray(self.friction.critical_slip)
            if np.any(barriers := np.isinf(strength)):  # any rate will do where nothing weakens
                own = np.where(barriers, 0.0, rates).max(axis=1, keepdims=True)
                rates = np.where(barriers, own, rates)
        if constant.any():
            # Residual from the start, tau_r = tau_p: then d_c = 0, and W is of no consequence.
            residual = np.minimum(residual, strength)
            slowest = np.min(rates, axis=1, where=~constant, initial=np.inf, keepdims=True)
            rates = np.where(constant, slowest, rates)
            if "constant" not in accept:
                warn_accuracy(
                    f"tau_p is not above residual_strength at {100.0 * constant.mean():.2g} % of"
                    " the nodes; these do not weaken: their strength stays tau_p"
                )
        too_few = self._too_few_nodes(
            steepest_rate(strength, residual, rates), mean_strength(strength)
        )
        if too_few:
            raise InputError(too_few)
        profile = np.array(np.broadcast_to(self.load.profile, (nodes,)), dtype=np.float64)
        return Rows(strength, residual, rates, initial, profile, self.interface.spacing)
