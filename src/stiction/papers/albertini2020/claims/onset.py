"""Claims about the critical stress, how much it varies, and the position of onset."""

from __future__ import annotations

import numpy as np
from scipy.stats import ks_2samp, kstest

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, Construction
from stiction.papers.albertini2020.claims.measures import at_each, labelled, pairs
from stiction.papers.albertini2020.claims.rules import (
    Above,
    Below,
    Chance,
    Falling,
    Rising,
    Verdict,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import SCATTER, nucleation_moments, scatter
from stiction.papers.albertini2020.studies.summary import estimates
from stiction.statistics.estimates import Estimate, mean, share, skewness


def _means(data: Data) -> tuple[Quantity, ...]:
    return at_each(data, lambda r: mean(data.at(r)["critical_stress"].values).scaled(1e-6), "MPa")


def _scatter(data: Data, measure: str) -> tuple[Quantity, ...]:
    label = SCATTER[measure]
    return at_each(data, lambda r: scatter(data, r)[measure].scaled(1e-3), "kPa", label)


def _three(data: Data) -> Measured:
    """The measure that the paper plots is judged; the two others stand beside it."""
    return Measured(
        _scatter(data, "lower"),
        (*_scatter(data, "quartiles"), *_scatter(data, "deviation")),
        comment="judged by what the paper plots, median less lower quartile; the standard"
        " deviation has a minimum near xi_0 = h_n",
    )


@claim(
    where="Abstract, Sec. 4.2, Conclusion",
    says="A longer correlation length lowers the critical stress, over the range studied.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Falling(),
)
def lower_friction(data: Data) -> Measured:
    """Means at the correlation lengths of the study."""
    return Measured(_means(data))


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="Between its two limits, from vanishing to very long correlation, the critical stress"
    " falls.",
    needs=("trend",),
    rule=Falling(),
)
def lower_friction_always(data: Data) -> Measured:
    """Mean at fixed L over a much wider range."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    series = [each.scaled(1e-6) for each in estimates(trend, "mean")]
    ratios = trend["ratio"].values
    lowest = int(np.argmin([each.value for each in series]))
    return Measured(
        labelled(ratios, series, "MPa"),
        comments={
            Verdict.CORRECTED: f"only up to about xi_0 = {ratios[lowest]:g} h_n if L is fixed, as"
            " here; then the interface holds too few correlation lengths and it rises again"
        },
    )


@claim(
    where="Abstract, Secs. 1 and 5.3",
    says="A shorter correlation length makes the critical stress vary less.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Rising(),
)
def less_variable(data: Data) -> Measured:
    """Three measures of the scatter of tau_cr at each correlation length of the study."""
    return _three(data)


@claim(
    where="Sec. 5.4",
    says="A shorter correlation length makes the critical stress vary more.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Falling(),
)
def more_variable(data: Data) -> Measured:
    """The same numbers, against the opposite statement."""
    return _three(data)


@claim(
    where="Conclusion",
    says="A vanishingly small correlation length makes the critical stress vary less.",
    needs=("trend",),
    rule=Rising(),
)
def vanishing_variability(data: Data) -> Measured:
    """Median less lower quartile up to the shortest correlation length of the study."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    series = [each.scaled(1e-3) for each in pairs(trend, "lower_spread")]
    short = trend["ratio"].values <= data.ratios[0]
    return Measured(
        labelled(trend["ratio"].values[short], np.array(series)[short], "kPa"),
        comment="median less lower quartile: so it is below the correlation lengths of the study",
    )


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="For vanishing correlation length the critical stress tends to the mean strength.",
    needs=("trend",),
    rule=Rising(),
)
def short_stress(data: Data) -> Measured:
    """What is missing to <tau_p>, at each halving."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    unit = 1.0 / data.setting.mean
    gaps = [
        Estimate(1.0 - each.value * unit, each.error * unit)
        for each in estimates(trend, "mean")[:4]
    ]
    ratios = trend["ratio"].values
    return Measured(
        labelled(ratios[:4], gaps),
        comment=f"1 - tau_cr/<tau_p>; slowly: {100 * gaps[0].value:.0f} % are still missing at"
        f" xi_0 = {ratios[0]:g} h_n",
    )


@claim(
    where="Sec. 4.2, Conclusion",
    says="For correlation much longer than h_n the critical stress becomes the minimum strength.",
    needs=("window",),
    rule=All(Falling(), Below(limits.AT_BOUND)),
)
def long_stress(data: Data) -> Measured:
    """Mean of tau_cr above min tau_p of the same field, for ever shorter h_n."""
    window = data["window"]
    series = labelled(window["ratio"].values, pairs(window, "excess", 1.0 / data.setting.mean))
    return Measured(
        (series, series[-1:]), comment="(tau_cr - min tau_p)/<tau_p>, with L/xi_0 held fixed"
    )


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="For correlation much longer than h_n the critical stress is close to the lower bound.",
    needs=("trend",),
    rule=Below(limits.CLOSE_TO_BOUND),
)
def near_the_bound(data: Data) -> Measured:
    """Share of the way from the lower to the upper bound at fixed L, from the longest length on."""
    trend = data["trend"].sel(mean_mode=int(data.setting.mean_mode))
    low, high = data.setting.bounds
    if not (np.isfinite(low) and np.isfinite(high)):
        return Measured((), comment="this strength is not bounded on both sides")
    long = trend["ratio"].values >= data.ratios[-1]
    series = [(each - low).scaled(1.0 / (high - low)) for each in estimates(trend, "mean")]
    return Measured(
        labelled(trend["ratio"].values[long], np.array(series)[long]),
        comment="share of the way from the lower to the upper bound; with L fixed the interface"
        " holds ever fewer correlation lengths to meet the bound: it needs L >> xi_0 >> h_n",
    )


@claim(
    where="Sec. 5.3",
    says="With strength skewed to low values the critical stress is close to the lower bound.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Below(limits.CLOSE_TO_BOUND),
)
def close_to_bound(data: Data) -> Measured:
    """Mean of tau_cr as a share of the way from the lower to the upper bound."""
    low, high = data.setting.bounds
    if not (np.isfinite(low) and np.isfinite(high)):
        return Measured((), comment="this strength is not bounded on both sides")
    return Measured(
        at_each(
            data,
            lambda r: (mean(data.at(r)["critical_stress"].values) - low).scaled(1 / (high - low)),
        ),
        comment="share of the way from the lower to the upper bound",
    )


@claim(
    where="Sec. 4.2, Fig. 5f",
    says="Taking the minimum amplifies the skewness, so that the mean critical stress falls with"
    " the correlation length.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Above(0.0, partly=True),
)
def skewness_amplified(data: Data) -> Measured:
    """Skewness of tau_cr less that of tau_n, at each correlation length."""
    return Measured(
        at_each(
            data,
            lambda r: (
                skewness(data.at(r)["critical_stress"].values) - nucleation_moments(data, r)[2]
            ),
        ),
        comment="skewness of tau_cr less that of tau_n",
        comments={
            Verdict.CORRECTED: "skewness of tau_cr less that of tau_n: amplified only at the longer"
            " correlation lengths, while the mean falls at all of them; what lowers it is the"
            " wider spread of tau_n"
        },
    )


@claim(
    where="Secs. 3.3 and 4.2, Fig. 5g",
    says="The onset may come anywhere: its position is uniformly distributed.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Chance(limits.CERTAIN),
)
def uniform_position(data: Data) -> Measured:
    """Kolmogorov-Smirnov probabilities."""
    length = data.setting.problem.interface.extent

    def chance(ratio: float) -> Estimate:
        where = data.at(ratio)["critical_position"].values / length
        return Estimate(round(float(kstest(where, "uniform").pvalue), 2))

    return Measured(at_each(data, chance), comment="Kolmogorov-Smirnov p-values")


@claim(
    where="Sec. 4.2",
    says="The position of onset is distributed alike at all correlation lengths.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Chance(limits.CERTAIN),
)
def position_independent(data: Data) -> Measured:
    """Two-sample Kolmogorov-Smirnov probabilities between disjoint halves of the samples."""
    half = data.samples // 2
    reference = data.at(data.ratios[0])["critical_position"].values[:half]
    chance = [
        round(float(ks_2samp(reference, data.at(r)["critical_position"].values[half:]).pvalue), 2)
        for r in data.ratios[1:]
    ]
    return Measured(
        labelled(data.ratios[1:], [Estimate(each) for each in chance]),
        comment=f"Kolmogorov-Smirnov p-values against xi_0/h_n = {data.ratios[0]:g}",
    )


@claim(
    where="Secs. 3.1 and 5.2, Conclusion",
    says="Sliding need not set in where the interface is weakest.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=Above(limits.COMMON, partly=True),
)
def weakest_does_not_govern(data: Data) -> Measured:
    """Share of samples whose onset is more than h_n/2 from the weakest node."""
    problem = data.setting.problem
    length = problem.interface.extent

    def apart(ratio: float) -> Estimate:
        at = data.at(ratio)
        gap = np.abs(at["critical_position"].values - at["weakest_position"].values)
        gap = np.minimum(gap, length - gap)
        return share(gap > 0.5 * problem.nucleation_length)

    return Measured(
        at_each(data, apart),
        comment="share of samples with the onset more than h_n/2 from the weakest point",
    )


@claim(
    where="Sec. 3.1",
    says="The critical stress is not reached when the first point begins to slip.",
    needs=("monte_carlo",),
    rule=Construction("an average of the strength over a length cannot be below its minimum"),
)
def above_first_slip(data: Data) -> Measured:
    """tau_cr above the weakest strength of the same sample, mean over <tau_p>."""
    unit = 1.0 / data.setting.mean

    def above(ratio: float) -> Estimate:
        at = data.at(ratio)
        return mean(at["critical_stress"].values - at["weakest_strength"].values).scaled(unit)

    return Measured(at_each(data, above), comment="(tau_cr - min tau_p)/<tau_p>")
