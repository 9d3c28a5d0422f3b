"""Claims about nucleation and run-away propagation: patches, energy balance, arrest."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from stiction.papers.albertini2020.claims.claim import Finding, Quantity, Verdict, claim
from stiction.papers.albertini2020.claims.rules import above, at_each, below, worst
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate, mean, share


@claim(
    where="Sec. 5.2",
    says="A crack longer than about 3 h_n cannot be arrested: its static energy release rate"
    " exceeds the largest fracture energy.",
    printed="3",
    needs=("monte_carlo",),
)
def runaway_length(data: Data) -> Finding:
    """Length of a shear crack under the stress drop tau_cr - tau_r whose G equals Gamma_max.

    For half-length a, G = pi a drop^2/(2 G*) (mode II, identical half-spaces), and
    Gamma_max = (tau_p,max - tau_r)^2/(2 W) (Albertini et al., 2020, Eq. 14).
    """
    problem = data.setting.problem
    high = data.setting.bounds[1]
    if not np.isfinite(high):
        return Finding((), Verdict.FAILS, "this strength has no upper bound, nor has Gamma")
    residual = float(np.mean(problem.friction.residual_strength))
    rate = float(np.max(problem.friction.weakening_rate))
    toughest = (high - residual) ** 2 / (2.0 * rate)
    series = []
    for ratio in data.ratios:
        drop = data.at(ratio)["critical_stress"].values - residual
        length = 4.0 * problem.effective_modulus * toughest / (math.pi * drop**2)
        series.append(mean(length / problem.nucleation_length))
    values = [each.value for each in series]
    # 'About 3': to within half a unit at every correlation length, or at least at one.
    near = [abs(value - 3.0) <= 0.5 for value in values]
    if all(near):
        verdict, comment = Verdict.HOLDS, ""
    else:
        partly = any(near) or min(values) < 3.0 < max(values)
        verdict = Verdict.CORRECTED if partly else Verdict.FAILS
        comment = f"{min(values):.2g} to {max(values):.2g} h_n"
    return Finding(at_each(data, series, "h_n"), verdict, comment)


@claim(
    where="Sec. 5.2",
    says="The static energy release rate grows in proportion to the length of the crack.",
)
def release_rate_grows(data: Data) -> Finding:
    """Logarithmic slope between h_n and 3 h_n on the periodic interface.

    A periodic row of collinear cracks of length 2a and period L under uniform drop has
    G = L drop^2 tan(pi a/L)/(2 G*) (Koiter, 1959), which is linear while a << L.
    """
    problem = data.setting.problem
    length, period = problem.nucleation_length, problem.interface.extent

    def rate(crack: float) -> float:
        return math.tan(math.pi * crack / (2.0 * period))

    slope = Estimate(math.log(rate(3.0 * length) / rate(length)) / math.log(3.0))
    verdict = Verdict.HOLDS if abs(slope.value - 1.0) < 0.05 else Verdict.CORRECTED
    return Finding(
        (Quantity("logarithmic slope from h_n to 3 h_n", slope),),
        verdict,
        "" if verdict is Verdict.HOLDS else "faster: neighbouring periods help",
    )


@claim(
    where="Sec. 5.2",
    says="Shorter than about 3 h_n a rupture may be arrested, longer it cannot be.",
    printed="3",
    needs=("arrest",),
)
def longest_arrest(data: Data) -> Finding:
    """Longest patch that came to rest by equilibrium, in units of h_n."""
    length = data["arrest"]["length"].values / data.setting.problem.nucleation_length
    if length.size == 0:
        return Finding(
            (Quantity("arrested events", Estimate(0.0)),), Verdict.OPEN, "none in these samples"
        )
    longest = float(length.max())
    return Finding(
        (
            Quantity("longest arrested patch", Estimate(longest), "h_n"),
            Quantity("samples", Estimate(float(length.size))),
        ),
        Verdict.HOLDS if longest <= 3.5 else Verdict.FAILS,
    )


@claim(
    where="Sec. 5.2",
    says="Randomness of strength alone does not arrest a rupture in the dynamic problem.",
    needs=("arrest", "interaction"),
)
def inertia_and_arrest(data: Data) -> Finding:
    """Share of the samples arrested by equilibrium that inertia does not carry through."""
    events = data["arrest"]
    shares = [
        float((data["interaction"]["arrested_events"].sel(correlation_ratio=r).values > 0).mean())
        for r in data.ratios
    ]
    count = events.sizes["event"]
    if count == 0:
        return Finding(
            (Quantity("arrested by equilibrium", Estimate(0.0)),), Verdict.OPEN, "none to run again"
        )
    stay = share(events["dynamic_arrests"].values > 0)
    both = stay.scaled(max(shares))
    none = stay.value == 0.0
    verdict = Verdict.HOLDS if none else below(both, 0.01)
    return Finding(
        (
            Quantity("run again", Estimate(float(count))),
            Quantity("of these arrested with inertia, too", stay),
            Quantity("share of all samples, at most", both),
        ),
        Verdict.CORRECTED if verdict is Verdict.HOLDS and not none else verdict,
        "extremely rare, but not never" if not none else "",
    )


@claim(
    where="Sec. 5.2",
    says="The unstable patch becomes a shear crack, driven by the static energy release rate.",
    needs=("ruptures",),
)
def shear_crack(data: Data) -> Finding:
    """Median front speed over the shear wave speed: below one the quasi-static picture applies."""
    speed = data.setting.problem.solid.shear_wave_speed
    runs = data["ruptures"]
    ratios = data.setting.simulated_ratios
    median = [
        mean(runs["median_rupture_speed"].sel(correlation_ratio=r).values / speed) for r in ratios
    ]
    largest = [mean(runs["rupture_speed"].sel(correlation_ratio=r).values / speed) for r in ratios]
    fast = [each.value > 1.0 for each in median]
    seismic = [
        float((data.setting.mean - s) / s)
        for s in (float(runs["critical_stress"].sel(correlation_ratio=r).mean()) for r in ratios)
    ]
    return Finding(
        (
            *(
                Quantity(f"median speed/c_s, xi_0/h_n = {r:g}", each)
                for r, each in zip(ratios, median, strict=True)
            ),
            *(
                Quantity(f"largest speed/c_s, xi_0/h_n = {r:g}", each)
                for r, each in zip(ratios, largest, strict=True)
            ),
        ),
        Verdict.CORRECTED if any(fast) else Verdict.HOLDS,
        "it soon runs faster than shear waves, where that balance no longer applies: the strength"
        f" excess over the stress drop is only {min(seismic):.2f} to {max(seismic):.2f}"
        if any(fast)
        else "",
    )


@claim(
    where="Sec. 5.4",
    says="Nucleation is of the pre-slip type: long slow slip, then abrupt acceleration.",
    needs=("representative", "ruptures"),
)
def pre_slip(data: Data) -> Finding:
    """Slow slip against rupture in time, and foreshocks: arrested events before the onset."""
    run = data["representative"]
    onset, start, end = float(run["onset_time"]), *run["step_time"].values[[0, -1]]
    ratio = (onset - start) / (end - onset)
    foreshocks = share(data["ruptures"]["arrested_events"].values.ravel() > 0)
    slow = ratio > 10.0
    rare = foreshocks.value <= 0.05
    return Finding(
        (
            Quantity("slow slip over rupture, in time", Estimate(float(f"{ratio:.3g}"))),
            Quantity("share of runs with a foreshock", foreshocks),
        ),
        Verdict.HOLDS if slow and rare else Verdict.CORRECTED if slow else Verdict.FAILS,
    )


@claim(
    where="Abstract, Sec. 5.2",
    says="Many patches slip at once, and their number grows with the load.",
    needs=("growth",),
)
def patches_grow(data: Data) -> Finding:
    """Mean number at 0.92, 0.96 and just below the load of the onset, shortest correlation."""
    study = data["growth"]["patches"].sel(correlation_ratio=data.ratios[0])
    levels = (0.92, 0.96, 0.999)
    numbers = [study.sel(level=level, method="nearest").values for level in levels]
    series = [mean(each) for each in numbers]
    # The same samples at each load: the steps are known better than the numbers.
    steps = [mean(right - left) for left, right in pairwise(numbers)]
    return Finding(
        tuple(
            Quantity(f"tau_0 = {level:g} tau_cr", each)
            for level, each in zip(levels, series, strict=True)
        ),
        worst([above(series[-1], 1.0), *(above(step, 0.0) for step in steps)]),
        f"at xi_0/h_n = {data.ratios[0]:g}",
    )


@claim(
    where="Sec. 5.2",
    says="Patches may merge, the critical one among them.",
    needs=("growth",),
)
def patches_merge(data: Data) -> Finding:
    """Mergers before the onset, and share of samples whose critical patch has merged."""
    study = data["growth"].sel(correlation_ratio=data.ratios[0])
    mergers = mean(study["mergers"].values[:, -1])
    critical = share(study["critical_merged"].values > 0)
    return Finding(
        (Quantity("mergers", mergers), Quantity("samples whose critical patch merged", critical)),
        worst([above(mergers, 0.0), above(critical, 0.0)]),
        f"at xi_0/h_n = {data.ratios[0]:g}",
    )


@claim(
    where="Sec. 5.2",
    says="The patch that becomes unstable need not be the first to appear.",
    needs=("growth",),
)
def not_the_first(data: Data) -> Finding:
    """Share of samples whose critical patch does not hold the weakest node."""
    series = [
        share(data["growth"]["critical_first"].sel(correlation_ratio=ratio).values == 0)
        for ratio in data.ratios
    ]
    return Finding(at_each(data, series), above(series[0], 0.0), "share of samples")
