"""Claims about the size of the scatter, the size of the interface, pressure, failure."""

from __future__ import annotations

import dataclasses

import numpy as np

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.measures import labelled, one, pairs
from stiction.papers.albertini2020.claims.rules import Above, Below, Falling, Graded, Rising, near
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import required_width, variation
from stiction.papers.albertini2020.studies.summary import estimates
from stiction.statistics.estimates import Estimate, mean, share

QUOTED = (0.32, 0.80)
"""Friction coefficients of gold on gold that the paper quotes (Rabinowicz, 1992)."""
QUOTED_VARIATION = (QUOTED[1] - QUOTED[0]) / 4.0 / (0.5 * (QUOTED[0] + QUOTED[1]))
"""Its coefficient of variation if the range spans two standard deviations to either side."""


@claim(
    where="Sec. 1",
    says="Random local strength may be the origin of scatter such as from 0.32 to 0.80.",
    printed="0.32 to 0.80",
    needs=("monte_carlo", "size"),
    onsets_of="monte_carlo",
    rule=Graded(
        limits.Limit("such as 0.32 to 0.80", QUOTED_VARIATION, "", "a quarter of the range over"
                     " its middle"),
        limits.Limit("visible", 0.02, "", "what a tilting plane shows: a degree in forty-five"),
    ),
)  # fmt: skip
def size_of_scatter(data: Data) -> Measured:
    """Coefficient of variation of tau_cr, least over the lengths; and what the quoted one takes."""
    each = labelled(data.ratios, [variation(data, ratio) for ratio in data.ratios])
    study = data["size"]
    beside = []
    for factor in (0.125, 1.0):
        wide, own = required_width(data, factor, QUOTED_VARIATION)
        lengths = factor * data.setting.problem.interface.extent
        beside += [
            Quantity(
                f"coefficient of variation of the strength that it takes at L/h_n ="
                f" {lengths / data.setting.problem.nucleation_length:.2g}",
                Estimate(float(f"{wide:.2g}")),
            )
        ]
    deviation, middle = estimates(study, "standard_deviation")[0], estimates(study, "mean")[0]
    shortest = deviation.scaled(1.0 / middle.value)
    return Measured(
        each,
        (*beside, *one("coefficient of variation of the strength here", own),
         Quantity("of tau_cr at an eighth of L", shortest)),
        comment=f"with the paper's strength 2.8 to 3.3 %, against {100 * QUOTED_VARIATION:.0f} %"
        " quoted: it takes a shorter interface and a wider strength",
    )  # fmt: skip


@claim(
    where="Sec. 5.3",
    says="A longer interface makes the critical stress vary less.",
    needs=("size",),
    rule=Falling(),
)
def longer_interface(data: Data) -> Measured:
    """Median less lower quartile of tau_cr against L."""
    study = data["size"]
    series = [each.scaled(1e-3) for each in pairs(study, "lower_spread")]
    return Measured(
        tuple(
            Quantity(f"{float(factor):g} L", each, "kPa")
            for factor, each in zip(study["length_factor"].values, series, strict=True)
        ),
        comment=f"median less lower quartile at xi_0/h_n = {study.attrs['correlation_ratio']:g};"
        " its mean falls too",
    )


@claim(
    where="Sec. 5.1",
    says="A free end lowers the critical stress locally, and hence that of a finite interface.",
    needs=("free_end",),
    rule=Below(0.0),
)
def free_end(data: Data) -> Measured:
    """Change of the mean of tau_cr in mode III where a mirrored field makes both ends free."""
    study = data["free_end"]
    change = 100.0 * (study["free"] / study["periodic"] - 1.0)
    return Measured(
        labelled(
            data.ratios,
            [mean(change.sel(correlation_ratio=ratio).values) for ratio in data.ratios],
            "%",
        ),
        comment="exactly, in mode III, where a mirrored field has free mirror planes",
    )


@claim(
    where="Sec. 5.1",
    says="As h_n/L tends to zero the distribution tends to that of the periodic interface.",
    needs=("free_end",),
    rule=Rising(),
)
def finite_size(data: Data) -> Measured:
    """Change of the mean of tau_cr by free ends, on ever longer interfaces."""
    study = data["free_end"]
    problem = data.setting.problem
    unit = problem.interface.extent / problem.nucleation_length
    return Measured(
        tuple(
            Quantity(f"L/h_n = {float(factor) * unit:.2g}", each.scaled(100.0), "%")
            for factor, each in zip(
                study["length_factor"].values, pairs(study, "finite_change"), strict=True
            )
        ),
        comment=f"at xi_0/h_n = {data.ratios[0]:g}, mode III",
    )


@claim(
    where="Sec. 5.1",
    says="The range of the effect of an end scales with h_n.",
    needs=("free_end",),
    rule=Above(0.0),
)
def end_range(data: Data) -> Measured:
    """Share of onsets within h_n/2 of an end less that by chance, over all correlation lengths."""
    study = data["free_end"]
    problem = dataclasses.replace(data.setting.problem, mode="III")
    chance = problem.nucleation_length / problem.interface.extent

    def excess(ratio: float) -> Estimate:
        return share(study["end"].sel(correlation_ratio=ratio).values < 0.5) - chance

    return Measured(
        (Quantity("together", share(study["end"].values.ravel() < 0.5) - chance),),
        labelled(data.ratios, [excess(ratio) for ratio in data.ratios]),
        comment="share of onsets within h_n/2 of an end above the share of the interface there",
    )


@claim(
    where="Sec. 5.3",
    says="The nucleation length is inversely proportional to tau_p - tau_r, as pressure changes.",
    needs=("pressure",),
    rule=near(-1.0, limits.SLOPE),
)
def length_against_pressure(data: Data) -> Measured:
    """Logarithmic slope of the critical patch by exact equilibrium against tau_p - tau_r."""
    study = data["pressure"]
    length = pairs(study, "patch_length")
    drop = np.log(study["drop"].values)
    y = np.log([each.value for each in length])
    error = np.array([each.error / each.value for each in length])
    slope = float(np.polyfit(drop, y, 1)[0])
    away = drop - drop.mean()
    spread = float(np.sqrt(np.sum((away * error) ** 2)) / np.sum(away**2))
    return Measured(
        (Quantity("logarithmic slope", Estimate(slope, spread)),),
        tuple(
            Quantity(f"critical patch at {float(f):g} times the pressure", each.scaled(1e3), "mm")
            for f, each in zip(study["pressure"].values, length, strict=True)
        ),
        comment="by exact equilibrium, with tau_r > 0; strengths in proportion to the pressure, d_c"
        " fixed",
    )


@claim(
    where="Sec. 5.3",
    says="More normal load acts like a longer interface: the friction coefficient varies less.",
    needs=("pressure",),
    rule=Falling(),
)
def pressure_like_length(data: Data) -> Measured:
    """Median less lower quartile of the friction coefficient against pressure."""
    study = data["pressure"]
    factors = study["pressure"].values

    def at(label: str, series: list[Estimate]) -> tuple[Quantity, ...]:
        return tuple(
            Quantity(f"{label}{float(f):g} times the pressure", each)
            for f, each in zip(factors, series, strict=True)
        )

    return Measured(
        at("", pairs(study, "lower_spread")),
        at("mean at ", list(estimates(study, "mean"))),
        comment="median less lower quartile of the friction coefficient; its mean falls too,"
        " though every point obeys Coulomb's law: h_n shrinks against xi_0",
    )


@claim(
    where="Sec. 5.3",
    says="The framework gives the failure probability of an interface of known strength.",
    needs=("failure", "monte_carlo"),
    rule=near(1.0, limits.Limit("gives", 0.5, "", "a probability for design: to a factor of 1.5")),
)
def failure_probability(data: Data) -> Measured:
    """Probability by subset simulation or importance sampling over that by plain counting."""
    study = data["failure"]
    computed = []
    for target in (1e-1, 1e-2):
        plain = study["plain_probability"].values
        at = int(np.nanargmin(np.abs(np.log(study["probability"].values / target))))
        if not plain[at] > 0.0:
            continue
        quotient = float(study["probability"].values[at] / plain[at])
        counted = plain[at] * 10_000
        error = quotient * float(
            np.hypot(study["coefficient_of_variation"].values[at], counted**-0.5)
        )
        computed.append(Quantity(f"over counting, P = {target:g}", Estimate(quotient, error)))
    last = int(study["probability"].values.argmin())
    return Measured(
        tuple(computed),
        one(
            f"stress with P = {float(study['probability'][last]):.1g}",
            round(1e-6 * float(study["stress"][last]), 4), "MPa",
        ),
        comment=f"at xi_0/h_n = {study.attrs['correlation_ratio']:g}, by the local criterion",
    )  # fmt: skip
