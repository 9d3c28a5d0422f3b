"""Claims of the discussion: what if the strength, its spectrum or the interface were different."""

from __future__ import annotations

import dataclasses

import numpy as np

from stiction.papers.albertini2020.claims.claim import Finding, Quantity, Verdict, claim
from stiction.papers.albertini2020.claims.rules import (
    above,
    at_each,
    below,
    falling,
    kilopascal,
    megapascal,
    rising,
    worst,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.studies.summary import estimate, estimates
from stiction.statistics.estimates import Estimate, mean, share


@claim(
    where="Sec. 5.3",
    says="A longer interface makes the critical stress vary less.",
    needs=("interface_length",),
)
def longer_interface(data: Data) -> Finding:
    """Standard deviation of tau_cr against L."""
    study = data["interface_length"]
    series = [kilopascal(each) for each in estimates(study, "standard_deviation")]
    return Finding(
        tuple(
            Quantity(f"{float(factor):g} L", each, "kPa")
            for factor, each in zip(study["length_factor"].values, series, strict=True)
        ),
        falling(series),
        f"at xi_0/h_n = {study.attrs['correlation_ratio']:g}; its mean falls too",
    )


@claim(
    where="Sec. 5.3",
    says="Strength skewed to high values would make the critical stress vary more.",
    needs=("skewness",),
)
def mirrored_variability(data: Data) -> Finding:
    """Standard deviation with the mirrored distribution over that with the setting's."""
    study = data["skewness"]
    series = []
    for ratio in data.ratios:
        own, other = (
            estimate(study, "standard_deviation", mirrored=which, correlation_ratio=ratio)
            for which in (0, 1)
        )
        quotient = other.value / own.value
        spread = np.hypot(other.error / other.value, own.error / own.value)
        series.append(Estimate(quotient, quotient * float(spread)))
    return Finding(
        at_each(data, series),
        worst([above(each, 1.0) for each in series]),
        "standard deviation with the mirrored distribution over that of the paper's",
    )


@claim(
    where="Sec. 5.3",
    says="With the other skewness, too, a shorter correlation length means a higher critical"
    " stress that varies less.",
    needs=("skewness",),
)
def mirrored_trend(data: Data) -> Finding:
    """Means and standard deviations of the mirrored distribution."""
    study = data["skewness"].sel(mirrored=1)
    means = [megapascal(each) for each in estimates(study, "mean")]
    deviations = [kilopascal(each) for each in estimates(study, "standard_deviation")]
    return Finding(
        (
            *at_each(data, means, "MPa"),
            *(
                Quantity(f"st. dev. at {ratio:g}", each, "kPa")
                for ratio, each in zip(data.ratios, deviations, strict=True)
            ),
        ),
        worst([falling(means), rising(deviations)]),
    )


@claim(
    where="Sec. 5.3",
    says="At equal length of decay to 1/e the form of the spectrum hardly matters to tau_cr.",
    needs=("spectrum",),
)
def spectrum_minor(data: Data) -> Finding:
    """Largest change of mean (against 1 %) and standard deviation (10 %) among the exponents."""
    study = data["spectrum"]
    computed, verdicts = [], []
    for exponent in study["exponent"].values:
        if exponent == data.setting.exponent:
            continue
        other = study.sel(exponent=exponent)
        for name, limit, label in (("mean", 1.0, "mean"), ("deviation", 10.0, "st. dev.")):
            change = 100.0 * np.abs(other[f"{name}_change"].values)
            at = int(change.argmax())
            error = 100.0 * float(other[f"{name}_change_error"].values[at])
            found = Estimate(float(change[at]), error)
            computed.append(Quantity(f"{label}, exponent {exponent:g}", found, "%"))
            verdicts.append(below(found, limit))
    return Finding(
        tuple(computed),
        worst(verdicts),
        "largest change over the correlation lengths, on the same draws; limits 1 % and 10 %",
    )


def _arrested(data: Data, case: str) -> Estimate:
    study = data["disorder"]["arrested_events"]
    return share(study.sel(case=case).values > 0)


def _cases(data: Data, *cases: str) -> tuple[Quantity, ...]:
    return tuple(Quantity(case, _arrested(data, case)) for case in cases)


@claim(
    where="Sec. 5.2",
    says="A larger variance of the strength makes arrest more likely.",
    needs=("disorder",),
)
def wider_range(data: Data) -> Finding:
    """Share of samples with an arrested event, by equilibrium, as the range widens."""
    cases = ("as it is", "twice the range", "four times the range")
    computed = _cases(data, *cases)
    verdict = rising([each.estimate for each in computed])
    most = computed[-1].estimate.value
    return Finding(
        computed,
        verdict,
        "the paper expects this 'slightly': four times the range arrests"
        f" {100.0 * most:.0f} % of samples"
        if verdict is Verdict.HOLDS and most > 0.1
        else "share of samples with an arrested event",
    )


@claim(
    where="Sec. 5.4",
    says="With a much larger strength range small events would come first, as in a cascade.",
    needs=("disorder",),
)
def cascade(data: Data) -> Finding:
    """Arrested events a sample with four times the range, against one in two samples."""
    events = data["disorder"]["arrested_events"]
    usual, wide = (mean(events.sel(case=c).values) for c in ("as it is", "four times the range"))
    return Finding(
        (Quantity("arrested events, as it is", usual), Quantity("four times the range", wide)),
        above(wide, 0.5),
        "arrested events a sample, by equilibrium",
    )


@claim(
    where="Abstract, Sec. 5.2",
    says="Arrested fronts need a driving force that is not uniform: a random stress drop does it.",
    needs=("disorder",),
)
def random_stress_drop(data: Data) -> Finding:
    """Share of arrests with random residual strength, and with a wide range of strength alone."""
    cases = [str(case) for case in data["disorder"]["case"].values]
    if "more random stress drop" not in cases:
        return Finding(_cases(data, "as it is"), Verdict.OPEN, "strength down to the residual one")
    drop = _cases(data, "as it is", "random stress drop", "more random stress drop")
    strength = _cases(data, "four times the range")
    works = above(drop[2].estimate - drop[0].estimate, 0.0)
    alone = above(strength[0].estimate - drop[0].estimate, 0.0)
    needed = worst([works, Verdict.CORRECTED]) if alone is Verdict.HOLDS else works
    return Finding(
        (*drop, *strength),
        needed,
        "it does it, but is not needed: a wider range of strength does it, too"
        if needed is Verdict.CORRECTED
        else "share of samples with an arrested event",
    )


@claim(
    where="Sec. 5.2",
    says="Random load on a small scale arrests nothing; at best it delays or hastens the onset.",
    needs=("disorder",),
)
def random_load(data: Data) -> Finding:
    """Share of arrests with random load as short as the strength, and the shift of tau_cr."""
    study = data["disorder"]
    usual, noisy = (study.sel(case=case) for case in ("as it is", "random load"))
    shift = mean(noisy["critical_stress"].values - usual["critical_stress"].values)
    shift = shift.scaled(100.0 / float(usual["critical_stress"].mean()))
    shares = _cases(data, "as it is", "random load")
    more = shares[1].estimate - shares[0].estimate
    few = below(shares[1].estimate, 0.1)
    verdict = Verdict.FAILS if above(more, 0.0) is Verdict.HOLDS else few
    lower = below(shift, 0.0) is Verdict.HOLDS
    return Finding(
        (*shares, Quantity("shift of mean tau_cr", shift, "%")),
        Verdict.CORRECTED if verdict is Verdict.HOLDS and lower else verdict,
        "on average it hastens: what counts is where strength less load is least" if lower else "",
    )


@claim(
    where="Sec. 5.1",
    says="A free end lowers the critical stress locally, and hence that of a finite interface.",
    needs=("free_end",),
)
def free_end(data: Data) -> Finding:
    """Change of tau_cr in mode III where a mirrored field makes both ends free, exactly."""
    study = data["free_end"]
    change = 100.0 * (study["free"] / study["periodic"] - 1.0)
    series = [mean(change.sel(correlation_ratio=ratio).values) for ratio in data.ratios]
    near = [share(study["end"].sel(correlation_ratio=ratio).values < 0.5) for ratio in data.ratios]
    return Finding(
        (
            *at_each(data, series, "%"),
            *(
                Quantity(f"onset within h_n/2 of an end, {ratio:g}", each)
                for ratio, each in zip(data.ratios, near, strict=True)
            ),
        ),
        worst([below(each, 0.0) for each in series]),
        "change of the mean; if onsets were spread evenly, the share so near an end would be"
        f" {_near_by_chance(data):.3f}",
    )


def _near_by_chance(data: Data) -> float:
    problem = dataclasses.replace(data.setting.problem, mode="III")
    return problem.nucleation_length / problem.interface.extent
