"""Claims whose verdict depends on the modulus that the paper used: judged under each reading."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import CLAIMS, Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, EachReading, Hypotheses
from stiction.papers.albertini2020.claims.measures import labelled, one
from stiction.papers.albertini2020.claims.rules import (
    Above,
    Below,
    Falling,
    Graded,
    SameCount,
    Verdict,
    Within,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.studies.modulus import READINGS
from stiction.statistics.estimates import Estimate

NEEDS = ("modulus",)
SIMULATED = (0.25, 0.5, 2.0)
"""Correlation lengths at which the paper ran 20 simulations each."""
_SHORT = " / ".join(f"({key}) {text}" for key, text in READINGS.items())


def _at(data: Data, reading: str, name: str, ratio: float, factor: float = 1.0) -> Estimate:
    study = data["modulus"].sel(reading=reading, correlation_ratio=ratio)
    return Estimate(float(study[name]), float(study[f"{name}_error"])).scaled(factor)


def _series(
    data: Data, reading: str, name: str, unit: str = "", ratios: tuple[float, ...] | None = None
) -> tuple[Quantity, ...]:
    chosen = data.ratios if ratios is None else ratios
    found = [_at(data, reading, name, ratio) for ratio in chosen]
    return labelled(chosen, found, unit, f"({reading})")


def _readings(of: Callable[[str], Any]) -> tuple[Any, ...]:
    return tuple(of(reading) for reading in READINGS)


def _simulated(data: Data) -> tuple[float, ...]:
    return tuple(ratio for ratio in data.ratios if ratio in SIMULATED) or data.ratios


@claim(
    where="Sec. 3.2, Eq. 8",
    says="In plane stress the effective modulus of mode II is G/(1-nu).",
    printed="G/(1-nu)",
    rule=Below(limits.AS_ONE),
)
def effective_modulus(data: Data) -> Measured:
    """Against 2 G (1 - c_s^2/c_d^2), the static limit of elastodynamics in that plane state."""
    solid = data.setting.problem.solid
    stress = dataclasses.replace(solid, plane="stress").effective_modulus("II")
    printed = solid.shear_modulus / (1.0 - solid.poisson_ratio)
    return Measured(
        one("too high by", 100.0 * abs(printed / stress - 1.0), "%"),
        (*one("G*/G of plane stress", stress / solid.shear_modulus),
         *one("G/(1-nu) over G", printed / solid.shear_modulus)),
        comment="in plane stress G* = G (1+nu); G/(1-nu) belongs to plane strain",
    )  # fmt: skip


@claim(
    where="Sec. 3.3",
    says="The nucleation length is 0.034 of the length of the interface.",
    printed="0.034",
    needs=NEEDS,
    rule=EachReading(Within(0.0335, 0.035, "0.034, rounded or cut off after the last digit")),
)
def nucleation_length(data: Data) -> Measured:
    """h_n/L of the formula under each reading."""
    found = data["modulus"]["length"]
    return Measured(
        _readings(lambda r: one(f"({r})", float(found.sel(reading=r)))),
        comment="0.0346 with the printed modulus, cut off and not rounded; 0.0308 in plane stress",
    )


@claim(
    where="Abstract, Secs. 3.3 and 6",
    says="The theory predicts the critical stress quantitatively well.",
    needs=NEEDS,
    rule=EachReading(Below(limits.WELL)),
)
def good_prediction(data: Data) -> Measured:
    """Root mean square error against exact equilibrium."""
    return Measured(
        _readings(lambda r: _series(data, r, "error", "%")),
        comment="root mean square error against exact equilibrium, which simulations confirm",
    )


@claim(
    where="Secs. 3.3 and 4.2, Conclusion",
    says="The theory predicts slightly too high a stress, the more so the shorter the correlation.",
    needs=NEEDS,
    rule=EachReading(All(Falling(), Above(0.0))),
)
def overpredicts(data: Data) -> Measured:
    """Mean over-prediction at each correlation length."""

    def both(reading: str) -> tuple[tuple[Quantity, ...], tuple[Quantity, ...]]:
        series = _series(data, reading, "bias", "%")
        return series, series[-1:]

    return Measured(_readings(both), comment="too high by so much on average")


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="From xi_0 = 0.5 h_n on, theory and simulation coincide in the mean.",
    needs=NEEDS,
    rule=EachReading(Below(limits.WELL)),
)
def coincide(data: Data) -> Measured:
    """Mean over-prediction from 0.5 on, at the lengths that were simulated."""
    chosen = tuple(ratio for ratio in _simulated(data) if ratio >= 0.5) or data.ratios[-1:]
    return Measured(_readings(lambda r: _series(data, r, "bias", "%", chosen)))


@claim(
    where="Secs. 4.2 and 5.2, Conclusion",
    says="The over-prediction at short correlation length comes from interaction of patches.",
    needs=NEEDS,
    rule=EachReading(Graded(limits.MOST, limits.PART)),
)
def interaction_explains(data: Data) -> Measured:
    """Share of interaction in the error of the prediction, on the same samples."""
    first = data.ratios[:1]
    return Measured(
        _readings(lambda r: _series(data, r, "interaction", "", first)),
        comment="all of it where the modulus is right; the smaller part where the prediction took"
        " the modulus of plane strain for simulations of plane stress",
    )


@claim(
    where="Sec. 3.3, Fig. 4c",
    says="The position of onset is predicted wrongly in 8 of 60 simulations.",
    printed="8 of 60",
    needs=NEEDS,
    rule=EachReading(SameCount(8, 60, limits.TWO_SIGMAS)),
)
def wrong_positions(data: Data) -> Measured:
    """Expected share in equal numbers of runs at each of the paper's correlation lengths."""
    chosen = _simulated(data)

    def expected(reading: str) -> tuple[Quantity]:
        shares = [_at(data, reading, "misplaced", ratio) for ratio in chosen]
        value = sum(each.value for each in shares) / len(shares)
        error = sum(each.error**2 for each in shares) ** 0.5 / len(shares)
        return (Quantity(f"({reading}) share", Estimate(value, error)),)

    return Measured(_readings(expected), comment="more than h_n/2 off; 8 of 60 is a share of 0.13")


@claim(
    where="Secs. 3.3 and 5.2",
    says="Wrong positions are more likely at short correlation length: 6 of the 8.",
    printed="6 of 8",
    needs=NEEDS,
    rule=EachReading(All(Falling(), SameCount(6, 8, limits.TWO_SIGMAS))),
)
def wrong_positions_short(data: Data) -> Measured:
    """Share of misplaced onsets, and the part of them at the shortest correlation length."""
    chosen = _simulated(data)

    def both(reading: str) -> tuple[tuple[Quantity, ...], tuple[Quantity]]:
        series = _series(data, reading, "misplaced", "", chosen)
        whole = sum(each.estimate.value for each in series)
        first = series[0].estimate
        part = first.scaled(1.0 / whole) if whole else Estimate(0.0, 1.0)
        return series, (Quantity(f"({reading}) at the shortest", part),)

    return Measured(_readings(both))


@claim(
    where="Sec. 5.2",
    says="At the shortest correlation length 20 to 30 patches slip by the time of onset.",
    printed="20 to 30",
    needs=NEEDS,
    rule=EachReading(Within(20.0, 30.0)),
)
def patches_at_onset(data: Data) -> Measured:
    """Mean number of slipping patches at the first instability."""
    first = data.ratios[:1]
    return Measured(
        _readings(lambda r: _series(data, r, "patches", "", first)), comment="mean over samples"
    )


DEPENDING = (
    nucleation_length, good_prediction, overpredicts, coincide, wrong_positions,
    wrong_positions_short, patches_at_onset,
)  # fmt: skip
"""What the printed results say of the modulus."""


@claim(
    where="Sec. 3.1, Eq. 8",
    says="Simulations and predictions are of plane stress.",
    needs=NEEDS,
    rule=Hypotheses(tuple(READINGS.values())),
)
def plane_stress(data: Data) -> Measured:
    """How many of the printed results each reading misses."""
    findings = [CLAIMS[each.__name__.replace("_", "-")].judge(data) for each in DEPENDING]
    missed = [
        sum(finding.by_reading[i] is Verdict.FAILS for finding in findings)
        for i in range(len(READINGS))
    ]
    return Measured(
        tuple(
            one(f"({key}) printed results missed, of {len(findings)}", count)[0]
            for key, count in zip(READINGS, missed, strict=True)
        ),
        comment=_SHORT,
    )
