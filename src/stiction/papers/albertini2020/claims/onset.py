"""Claims about the critical stress and the position of onset."""

from __future__ import annotations

import numpy as np
from scipy.stats import ks_2samp, kstest

from stiction.papers.albertini2020.claims.claim import Finding, Quantity, Verdict, claim
from stiction.papers.albertini2020.claims.rules import (
    above,
    at_each,
    below,
    falling,
    kilopascal,
    megapascal,
    rising,
    steps_down,
    worst,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import nucleation_moments
from stiction.papers.albertini2020.studies.summary import estimates
from stiction.statistics.estimates import Estimate, mean, share, skewness, standard_deviation

REJECT = 0.01
"""Probability at which equality of distributions is given up, over all correlation lengths."""


def _means(data: Data) -> list[Estimate]:
    return [mean(data.at(ratio)["critical_stress"].values) for ratio in data.ratios]


def _deviations(data: Data) -> list[Estimate]:
    return [standard_deviation(data.at(ratio)["critical_stress"].values) for ratio in data.ratios]


@claim(
    where="Abstract, Secs. 3.3 and 4.2, Conclusion",
    says="A longer correlation length lowers the critical stress, over the range studied.",
    needs=("monte_carlo",),
)
def lower_friction(data: Data) -> Finding:
    """Means at the correlation lengths of the study."""
    series = [megapascal(each) for each in _means(data)]
    return Finding(at_each(data, series, "MPa"), falling(series))


@claim(
    where="Abstract, Sec. 5.3",
    says="A longer correlation length lowers the critical stress, whatever the length.",
    needs=("trend",),
)
def lower_friction_always(data: Data) -> Finding:
    """Where the mean has its minimum at fixed L, over a much wider range."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    series = [megapascal(each) for each in estimates(trend, "mean")]
    ratios = trend["ratio"].values
    lowest = int(np.argmin([each.value for each in series]))
    fall, rise = steps_down(series)
    if rise == 0:
        verdict = Verdict.HOLDS if fall == len(series) - 1 else Verdict.OPEN
    else:
        verdict = Verdict.CORRECTED if fall else Verdict.FAILS
    comment = f"only up to about xi_0 = {ratios[lowest]:g} h_n if L is fixed; then it rises again"
    return Finding(
        tuple(
            Quantity(f"xi_0/h_n = {ratios[i]:g}", series[i], "MPa")
            for i in sorted({0, lowest, len(series) - 1})
        ),
        verdict,
        comment if rise else "",
    )


@claim(
    where="Abstract, Sec. 5.3, Conclusion",
    says="A shorter correlation length makes the critical stress vary less.",
    needs=("monte_carlo",),
)
def less_variable(data: Data) -> Finding:
    """Standard deviation of tau_cr at each correlation length of the study."""
    series = [kilopascal(each) for each in _deviations(data)]
    return Finding(at_each(data, series, "kPa"), rising(series), _about_variability(series, +1))


@claim(
    where="Sec. 5.4",
    says="A shorter correlation length makes the critical stress vary more.",
    needs=("monte_carlo",),
)
def more_variable(data: Data) -> Finding:
    """The same numbers, against the opposite statement."""
    series = [kilopascal(each) for each in _deviations(data)]
    return Finding(at_each(data, series, "kPa"), falling(series), _about_variability(series, -1))


def _about_variability(series: list[Estimate], sign: int) -> str:
    fall, rise = steps_down(series)
    if fall and rise:
        return "neither way: the standard deviation goes through a minimum"
    if fall and sign > 0:
        return "the other way round over this range"
    if rise and sign < 0:
        return "the other way round over this range"
    return ""


@claim(
    where="Conclusion",
    says="For vanishing correlation length the critical stress varies less and less.",
    needs=("trend",),
)
def vanishing_variability(data: Data) -> Finding:
    """Standard deviation at the two shortest lengths of the wide study, against the next."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    series = [kilopascal(each) for each in estimates(trend, "standard_deviation")]
    ratios = trend["ratio"].values
    return Finding(
        tuple(
            Quantity(f"xi_0/h_n = {ratio:g}", each, "kPa")
            for ratio, each in zip(ratios[:3], series[:3], strict=True)
        ),
        rising(series[:3]),
        "only well below the correlation lengths of the study",
    )


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="For vanishing correlation length the critical stress tends to the mean strength.",
    needs=("trend",),
)
def short_stress(data: Data) -> Finding:
    """What is missing to <tau_p>, at each halving; it must shrink and by ever more of itself."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    unit = 1.0 / data.setting.mean
    gaps = [
        Estimate(1.0 - each.value * unit, each.error * unit)
        for each in estimates(trend, "mean")[:4]
    ]
    ratios = trend["ratio"].values
    verdict = rising(gaps)
    left = gaps[0].value
    return Finding(
        tuple(
            Quantity(f"xi_0/h_n = {ratio:g}", gap)
            for ratio, gap in zip(ratios[:4], gaps, strict=True)
        ),
        verdict,
        f"1 - tau_cr/<tau_p>; slowly: {100 * left:.0f} % are still missing at"
        f" xi_0 = {ratios[0]:g} h_n",
    )


@claim(
    where="Sec. 4.2, Conclusion",
    says="For correlation much longer than h_n the critical stress becomes the minimum strength.",
    needs=("window",),
)
def long_stress(data: Data) -> Finding:
    """Mean of tau_cr above min tau_p of the same field, for ever shorter h_n."""
    window = data["window"]
    unit = 1.0 / data.setting.mean
    pairs = zip(window["excess"].values, window["excess_error"].values, strict=True)
    series = [Estimate(float(value) * unit, float(error) * unit) for value, error in pairs]
    small = series[-1].value < 0.01
    verdict = falling(series)
    return Finding(
        tuple(
            Quantity(f"xi_0/h_n = {float(ratio):g}", each)
            for ratio, each in zip(window["ratio"].values, series, strict=True)
        ),
        verdict if small else worst([verdict, Verdict.OPEN]),
        "(tau_cr - min tau_p)/<tau_p>, with L/xi_0 held fixed",
    )


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="For correlation much longer than h_n the critical stress is close to the lower bound.",
    needs=("trend",),
)
def near_the_bound(data: Data) -> Finding:
    """Mean above the lower bound at fixed L: at its lowest, and at the longest correlation."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    low = data.setting.bounds[0]
    if not np.isfinite(low):
        return Finding((), Verdict.FAILS, "this strength has no lower bound")
    series = [(each - low).scaled(1.0 / data.setting.mean) for each in estimates(trend, "mean")]
    ratios = trend["ratio"].values
    lowest = int(np.argmin([each.value for each in series]))
    turned = (series[-1] - series[lowest]).value > 0.0 and lowest < len(series) - 1
    close = below(series[lowest], 0.05)
    if close is Verdict.HOLDS and turned:
        close = Verdict.CORRECTED
    return Finding(
        (
            Quantity(f"xi_0/h_n = {ratios[lowest]:g}", series[lowest]),
            Quantity(f"xi_0/h_n = {ratios[-1]:g}", series[-1]),
        ),
        close,
        "with L fixed the interface then holds too few correlation lengths to meet the bound: it"
        " needs L >> xi_0 >> h_n (computed: (tau_cr - bound)/<tau_p>)"
        if turned
        else "(tau_cr - bound)/<tau_p>",
    )


@claim(
    where="Sec. 5.3",
    says="With strength skewed to low values the critical stress is close to the lower bound.",
    needs=("monte_carlo",),
)
def close_to_bound(data: Data) -> Finding:
    """Mean of tau_cr as a share of the way from the lower to the upper bound, against 0.15."""
    low, high = data.setting.bounds
    if not (np.isfinite(low) and np.isfinite(high)):
        return Finding((), Verdict.FAILS, "this strength is not bounded on both sides")
    series = [(each - low).scaled(1.0 / (high - low)) for each in _means(data)]
    return Finding(
        at_each(data, series),
        worst([below(each, 0.15) for each in series]),
        "share of the way from the lower to the upper bound",
    )


@claim(
    where="Sec. 4.2, Fig. 5f",
    says="The minimum amplifies the effect of skewness: tau_cr is more skewed than tau_n.",
    needs=("monte_carlo",),
)
def skewness_amplified(data: Data) -> Finding:
    """Skewness of tau_cr less that of tau_n, at each correlation length."""
    gaps = [
        skewness(data.at(ratio)["critical_stress"].values) - nucleation_moments(data, ratio)[2]
        for ratio in data.ratios
    ]
    verdicts = [above(each, 0.0) for each in gaps]
    if Verdict.HOLDS in verdicts and Verdict.FAILS in verdicts:
        where = [f"{r:g}" for r, v in zip(data.ratios, verdicts, strict=True) if v is Verdict.HOLDS]
        verdict, comment = Verdict.CORRECTED, f"only at xi_0/h_n = {', '.join(where)}"
    else:
        verdict, comment = worst(verdicts), ""
    return Finding(
        at_each(data, gaps), verdict, f"{comment} (skewness of tau_cr less that of tau_n)".strip()
    )


@claim(
    where="Secs. 3.3 and 4.2, Fig. 5g",
    says="The onset may come anywhere: its position is uniformly distributed.",
    needs=("monte_carlo",),
)
def uniform_position(data: Data) -> Finding:
    """Kolmogorov-Smirnov probabilities, against 0.01 over all correlation lengths together."""
    length = data.setting.problem.interface.extent
    chance = [
        float(kstest(data.at(ratio)["critical_position"].values / length, "uniform").pvalue)
        for ratio in data.ratios
    ]
    verdict = Verdict.HOLDS if min(chance) > REJECT / len(chance) else Verdict.FAILS
    return Finding(
        at_each(data, [Estimate(each) for each in chance]), verdict, "Kolmogorov-Smirnov p-values"
    )


@claim(
    where="Sec. 4.2",
    says="The position of onset is distributed alike at all correlation lengths.",
    needs=("monte_carlo",),
)
def position_independent(data: Data) -> Finding:
    """Two-sample Kolmogorov-Smirnov probabilities between disjoint halves of the samples."""
    half = data.samples // 2
    reference = data.at(data.ratios[0])["critical_position"].values[:half]
    chance = [
        float(ks_2samp(reference, data.at(ratio)["critical_position"].values[half:]).pvalue)
        for ratio in data.ratios[1:]
    ]
    computed = tuple(
        Quantity(f"xi_0/h_n = {data.ratios[0]:g} against {ratio:g}", Estimate(each))
        for ratio, each in zip(data.ratios[1:], chance, strict=True)
    )
    verdict = Verdict.HOLDS if min(chance) > REJECT / len(chance) else Verdict.FAILS
    return Finding(computed, verdict, "Kolmogorov-Smirnov p-values")


@claim(
    where="Secs. 3.1 and 5.2, Conclusion",
    says="Sliding need not set in where the interface is weakest.",
    needs=("monte_carlo",),
)
def weakest_does_not_govern(data: Data) -> Finding:
    """Share of samples whose onset is more than h_n/2 from the weakest node."""
    problem = data.setting.problem
    length = problem.interface.extent
    series = []
    for ratio in data.ratios:
        at = data.at(ratio)
        gap = np.abs(at["critical_position"].values - at["weakest_position"].values)
        gap = np.minimum(gap, length - gap)
        series.append(share(gap > 0.5 * problem.nucleation_length))
    return Finding(
        at_each(data, series),
        worst([above(each, 0.01) for each in series]),
        "share of samples with the onset more than h_n/2 from the weakest point",
    )


@claim(
    where="Sec. 3.1",
    says="The critical stress is not reached when the first point begins to slip.",
    needs=("monte_carlo",),
)
def above_first_slip(data: Data) -> Finding:
    """tau_cr above the weakest strength of the same sample, mean over <tau_p>."""
    unit = 1.0 / data.setting.mean
    series = [
        mean(
            data.at(ratio)["critical_stress"].values - data.at(ratio)["weakest_strength"].values
        ).scaled(unit)
        for ratio in data.ratios
    ]
    return Finding(
        at_each(data, series),
        worst([above(each, 0.0) for each in series]),
        "(tau_cr - min tau_p)/<tau_p>",
    )


@claim(
    where="Sec. 5.4",
    says="A shorter correlation length raises the mean stress drop.",
    needs=("monte_carlo",),
)
def stress_drop(data: Data) -> Finding:
    """Mean of tau_cr less the residual strength, where sliding ends up."""
    residual = float(np.mean(data.setting.problem.friction.residual_strength))
    series = [megapascal(each - residual) for each in _means(data)]
    return Finding(at_each(data, series, "MPa"), falling(series))
