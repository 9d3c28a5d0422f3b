"""Change of a design with the family of the factor and with assumed constants.

Problem. The interval of a design contains the error of the computation. Assumptions
have a larger effect: constants in the problem that were not measured, and the
family of the factor. How large is this effect?

Source. The method is local sensitivities with common random numbers, as in Asmussen
and Glynn, Stochastic Simulation (2007), chapter VII.

All steps use the same draws, so that differences are accurate:

1. Solve `SAMPLES_PER_END` samples, and take the quantile at the design probability
   (`factors.solve`).
2. For each family, take the quantile over the interfaces with this family. These
   interfaces are draws from the posterior given the family.
3. For each constant solve the same samples at both ends of its range: a stated range, the
   5 and 95 % quantiles of an uncertain constant, or `USUAL_SHARE` below and above its
   value.
4. Multiply the design by the ratios of the quantiles from steps 2 and 3 to the
   quantile from step 1.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stiction.base.errors import InputError, collect_warnings
from stiction.base.model import is_finite
from stiction.ensemble.limit_state import LimitState
from stiction.random.dotted_keys import with_values
from stiction.random.marginals import FACTOR_FAMILIES
from stiction.reliability.factors import Counts, solve

SAMPLES_PER_END = 300
"""Samples that are solved at each end of a range."""
USUAL_SHARE = 0.1
"""Share of a constant below and above its value if no range is stated."""
CONSTANTS = (
    "friction.residual_ratio", "friction.residual_strength", "friction.weakening_rate",
    "friction.critical_slip", "friction.fracture_energy", "load.normal_pressure",
    "load.pressing_force", "solid.shear_modulus", "specimen.height", "specimen.drive.stiffness",
    "specimen.drive.height",
)  # fmt: skip
"""Dotted keys of the constants that may be assumed, if they are numbers in a problem."""
FAMILY = "family of the factor"


def value_at(problem: Any, key: str) -> Any:
    """Return the value at a dotted key of a problem, or None."""
    value = problem
    for name in key.split("."):
        value = getattr(value, name, None)
    return value


def ranges_of(problem: Any, random: Any, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return the range of each constant by dotted key without ``problem.``."""
    ranges = {}
    for key in CONSTANTS:
        value = value_at(problem, key)
        if np.ndim(value) == 0 and is_finite(value) and value > 0.0:
            ranges[key] = value * (1.0 - USUAL_SHARE), value * (1.0 + USUAL_SHARE)
    laws = getattr(getattr(random, "source", None), "laws", {})
    given: dict[str, Any] = {key: law.ppf([0.05, 0.95]).tolist() for key, law in laws.items()}
    given |= stated
    for key, ends in given.items():
        short = key.removeprefix("problem.")
        if key.startswith("problem.") and value_at(problem, short) is not None:
            ranges[short] = tuple(ends)
        elif key in stated:
            raise InputError(f"sensitivities: {key}: is not a constant of this problem")
    return ranges


def sensitivities(
    state: LimitState, probability: float, stress: float, stated: Mapping[str, Any]
) -> xr.Dataset:
    """Return the design stress at both ends of each source, with the largest effect first."""
    experiment = state.experiment
    problem, random = experiment.problem, experiment.random
    # Constants are all at their values, because their ranges are sources.
    if getattr(random, "constants", ()):
        random = replace(random, constants=())
    rows: list[tuple[str, str, str, float, float]] = []  # source, its ends, quantiles there
    with collect_warnings():
        fixed_state = replace(state, experiment=replace(experiment, random=random))
        # 1. and 2.
        counts = solve(fixed_state, 0, SAMPLES_PER_END)
        reference = counts.tail.quantile(probability)
        families = _by_family(counts, probability)
        if len(families) > 1:
            least, most = (pick(families, key=families.__getitem__) for pick in (min, max))
            rows.append((FAMILY, least, most, families[least], families[most]))
        # 3.
        for key, ends in ranges_of(problem, experiment.random, stated).items():
            state.meter.note = f"what moves the design: {key}"
            try:
                at_ends = [
                    solve(_at(fixed_state, key, end), 0, SAMPLES_PER_END) for end in ends
                ]
            except InputError:  # the constant cannot have this value
                continue
            quantiles = [counted.tail.quantile(probability) for counted in at_ends]
            texts = [f"{end:.4g}" for end in ends]
            rows.append((f"problem.{key}", texts[0], texts[1], quantiles[0], quantiles[1]))
    # 4.
    rows.sort(key=lambda row: -abs(row[4] - row[3]))
    columns: Any = zip(*rows, strict=True) if rows else ([],) * 5
    names, low, high, at_low, at_high = columns
    ratios = np.array([at_low, at_high], dtype=float).reshape(2, -1) / reference
    area = problem.area or np.nan
    effects = xr.Dataset(
        {
            "low": ("source", np.array(low, dtype=str)),
            "high": ("source", np.array(high, dtype=str)),
            "stress_at_low": ("source", stress * ratios[0], {"units": "Pa"}),
            "stress_at_high": ("source", stress * ratios[1], {"units": "Pa"}),
            "force_at_low": ("source", area * stress * ratios[0], {"units": "N"}),
            "force_at_high": ("source", area * stress * ratios[1], {"units": "N"}),
        },
        {"source": np.array(names, dtype=str)},
        {"probability": probability, "stress": stress},
    )
    for name, value in families.items():
        effects.attrs[f"stress by {name}"] = stress * value / reference
    return effects


def _at(state: LimitState, key: str, value: float) -> LimitState:
    """Return the limit state with a different value of a constant."""
    problem = with_values(state.experiment.problem, {key: value}, "problem")
    return replace(state, experiment=replace(state.experiment, problem=problem))


def _by_family(counts: Counts, probability: float) -> dict[str, float]:
    """Return the quantile for each family of the factor with enough specimens (step 2)."""
    random = counts.state.experiment.random
    laws, law = random.factor_laws
    names = {family: name for name, family in FACTOR_FAMILIES.items()}
    kinds = np.array([names.get(type(one), getattr(one, "type", "none")) for one in laws])[law]
    quantiles = {}
    for kind in np.unique(kinds):
        stresses = np.where(kinds[counts.members] == kind, counts.values, np.nan)
        rows = stresses[np.isfinite(stresses).any(axis=1)]
        if np.isfinite(rows).sum() * probability >= 1.0:
            quantiles[str(kind)] = float(np.nanquantile(rows, probability))
    return quantiles
