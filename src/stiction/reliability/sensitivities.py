"""What moves a design: each family of the factor between specimens, and each assumed constant.

Problem. The interval of a design holds the error of the computation. What was assumed moves the
design more: constants of the problem that were not measured, and the family of the factor.

Steps, with the draws of the same solved samples everywhere, so that differences are accurate:

1. Solve `SAMPLES_PER_END` samples and take the quantile of the design's probability
   (`factors.solve`).
2. For each family take the quantile over the interfaces with this family: these are draws from the
   posterior given the family.
3. For each constant solve the same samples at either end of its range: the stated one, the 5 and
   95 % quantiles of an uncertain constant, or `USUAL_SHARE` below and above its value.
4. Multiply the design by the ratios of these quantiles to the first.
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
"""Share of a constant below and above its value where no range is stated."""
CONSTANTS = (
    "friction.residual_ratio", "friction.residual_strength", "friction.weakening_rate",
    "friction.critical_slip", "friction.fracture_energy", "load.normal_pressure",
    "load.pressing_force", "solid.shear_modulus", "specimen.height", "specimen.drive.stiffness",
    "specimen.drive.height",
)  # fmt: skip
"""Constants of a problem that may be assumed, by dotted key; those that are numbers count."""
FAMILY = "family of the factor"


def value_at(problem: Any, key: str) -> Any:
    """Return the value of a dotted key of a problem; None if there is none."""
    value = problem
    for name in key.split("."):
        value = getattr(value, name, None)
    return value


def ranges_of(problem: Any, random: Any, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return the range of each constant, by dotted key without ``problem.``."""
    ranges = {}
    for key in CONSTANTS:
        value = value_at(problem, key)
        if np.ndim(value) == 0 and is_finite(value) and value > 0.0:
            ranges[key] = value * (1.0 - USUAL_SHARE), value * (1.0 + USUAL_SHARE)
    laws = getattr(getattr(random, "source", None), "laws", {})
    given = {key: tuple(map(float, law.ppf([0.05, 0.95]))) for key, law in laws.items()} | {
        **stated
    }
    for key, ends in given.items():
        short = key.removeprefix("problem.")
        if key.startswith("problem.") and value_at(problem, short) is not None:
            ranges[short] = tuple(ends)
        elif key in stated:
            raise InputError(f"sensitivities: {key}: is no constant of this problem")
    return ranges


def sensitivities(
    state: LimitState, probability: float, stress: float, stated: Mapping[str, Any]
) -> xr.Dataset:
    """Return the stress of a probability at either end of each source, the widest first."""
    experiment = state.experiment
    problem, random = experiment.problem, experiment.random
    if getattr(random, "constants", ()):  # each at its value; its range is a source
        random = replace(random, constants=())
    rows: list[tuple[str, str, str, float, float]] = []  # source, its ends, quantiles there
    with collect_warnings():
        fixed_state = replace(state, experiment=replace(experiment, random=random))
        counts = solve(fixed_state, 0, SAMPLES_PER_END)
        reference = counts.tail.quantile(probability)
        families = _by_family(counts, probability)
        if len(families) > 1:
            least, most = (pick(families, key=families.__getitem__) for pick in (min, max))
            rows.append((FAMILY, least, most, families[least], families[most]))
        for key, ends in ranges_of(problem, experiment.random, stated).items():
            state.meter.note = f"what moves the design: {key}"
            try:
                quantiles = [
                    solve(_at(fixed_state, key, end), 0, SAMPLES_PER_END).tail.quantile(
                        probability
                    )
                    for end in ends
                ]
            except InputError:  # the end is no value that it may have
                continue
            texts = [f"{end:.4g}" for end in ends]
            rows.append((f"problem.{key}", texts[0], texts[1], quantiles[0], quantiles[1]))
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
    problem = with_values(state.experiment.problem, {key: value}, "problem")
    return replace(state, experiment=replace(state.experiment, problem=problem))


def _by_family(counts: Counts, probability: float) -> dict[str, float]:
    """Return the quantile by each family of the factor, of which there are enough interfaces."""
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
