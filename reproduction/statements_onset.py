"""What the paper says of its parameters, the nucleation stress, and the onset."""

import functools
import math

import numpy as np
from scipy.special import ndtr
from scipy.stats import ks_2samp, kstest

import stiction as st
from reproduction import numbers_with_errors as estimates
from reproduction import rules, setting
from reproduction.claims import Beyond, Check, Claim, Data, Series, one, over_ratios
from reproduction.modulus import at
from reproduction.numbers_with_errors import Number, deviation, lower_spread, mean, share
from reproduction.rules import above, alike, below, each, falling, graded, rising, within
from reproduction.setting import DEVIATION, FIRST, HIGH, LOW, MEAN, RATIOS, SIMULATED
from reproduction.studies import NORMAL, READINGS, infinite_variance_ratio

PER_CENT, KPA, MPA = 100.0, 1e-3, 1e-6
SEEN, TENTH = "what a plot can show", "a tenth of what a plot can show"
SPECTRUM = setting.strength(1.0).spectrum
POINT_SKEWNESS = float(setting.MARGINAL.distribution.stats(moments="s"))


def tau_n_moments(d: Data, ratio: float) -> tuple[Number, Number, Number]:
    """Return mean and standard deviation over <tau_p>, and skewness, of tau_n."""
    shift, spread, skew = estimates.pooled_moments(d.at("moments", "powers", ratio))
    return Number(1.0 + shift.value, shift.error), spread, skew


def _from_normal(d: Data, ratio: float) -> Number:
    """Return the distance of tau_n from a normal distribution over that of tau_p."""
    rows = d.at("moments", "below", ratio)
    gaps = [abs(mean(row) - ndtr(z)) for row, z in zip(rows.T, NORMAL, strict=True)]
    strength_gaps = setting.MARGINAL.distribution.cdf(MEAN + NORMAL * DEVIATION) - ndtr(NORMAL)
    return max(gaps, key=lambda gap: gap.value) / float(np.abs(strength_gaps).max())


def _slope(d: Data) -> Number:
    theory = d["theory"]
    ratio, value = theory["ratio"].values, theory["infinite"].values
    return Number(float(np.log(value[1] / value[0]) / np.log(ratio[1] / ratio[0])))


def _above_bound(value: Number) -> Number:
    return (value - LOW) * (1.0 / (HIGH - LOW))


def trend(d: Data, function, factor: float) -> list[tuple[float, Number]]:
    """Return a statistic of tau_cr over the wide range of correlation lengths."""
    study = d["trend"]["critical_stress"]
    return [
        (float(row.ratio), function(row.values) * factor)
        for row in study.transpose("ratio", ...)
    ]


MEASURES = {
    "median less lower quartile": lower_spread,
    "upper less lower quartile": lambda values: lower_spread(values, 0.75),
    "standard deviation": deviation,
}
"""Measures of how much tau_cr varies: the paper plots the first and speaks of the last."""


def spreads(d: Data) -> list[Series]:
    """Return all measures over the paper's range."""
    return [
        over_ratios(label, "kPa", lambda r, f=function: f(d.stress(r)) * KPA)
        for label, function in MEASURES.items()
    ]


def _beyond(measures: dict, low: float, high: float):
    """Return a measure: statistics of tau_cr over a part of the wide range, with L fixed."""
    return lambda d: ([
        Series(f"{label}, L fixed", "kPa",
               [row for row in trend(d, function, KPA) if low <= row[0] <= high])
        for label, function in measures.items()
    ], [])  # fmt: skip


def _towards_zero(d: Data) -> list[Series]:
    study = d["vanishing"]["stress"]
    rows = []
    for label, function in MEASURES.items():
        least = function(study.sel(ratio=min(study.ratio.values)).values)
        rows.append(over_ratios(f"{label}, less that at h_n/64", "kPa", lambda r, f=function,
                                least=least: (f(d.stress(r)) - least) * KPA))  # fmt: skip
    return rows


def _window(d: Data, function) -> list[tuple[float, Number]]:
    """Return function(onsets, weakest points) as the nucleation length vanishes."""
    study = d["window"]
    rows = zip(study.ratio.values, study.stress.values, study.weakest.values, strict=True)
    return [(float(ratio), function(*each)) for ratio, *each in rows]


def _excess(stress, weakest) -> Number:
    return mean(stress - weakest) * (1.0 / MEAN)


def _towards_bound(d: Data):
    """Return the share of the way from lower to upper bound, in both limits of a long xi_0."""
    window = _window(d, lambda stress, weakest: _above_bound(mean(stress)))
    wide = [(r, _above_bound(v)) for r, v in trend(d, mean, 1.0) if r >= 2.0]
    label = "share of the way from lower to upper bound, {} fixed"
    rows = [Series(label.format(k), "", v) for k, v in (("L/xi_0", window), ("L", wide))]
    return [part for row in rows for part in _pair(row, -1)[0]], []


def _apart(stress, weakest) -> tuple[Number, Number]:
    """Return the distance of the two distributions, from different samples, and its p-value."""
    half = stress.size // 2
    test = ks_2samp(stress[:half], weakest[half:])
    distance = Number(float(test.statistic), 0.5 / math.sqrt(stress.size))
    return distance, Number(float(test.pvalue))


PARAMETERS = [
    Check("mean-strength", rules.printed("1"), lambda d: ([one("<tau_p>", MEAN * MPA, "MPa")], [])),
    Check("strength-deviation", rules.printed("0.2"),
        lambda d: ([one("standard deviation", DEVIATION * MPA, "MPa")], [])),
    Check("lower-bound", rules.printed("0.66"),
        lambda d: ([one("tau_p,min/<tau_p>", LOW / MEAN)], [])),
    Check("nucleation-factor", rules.printed("1.158"),
        lambda d: ([one("h_n W/G*", setting.H * setting.W / setting.G_STAR)], [])),
    Check("unit-weight", rules.printed("0.751"),
        lambda d: ([one("factor", 1.0 / (math.pi / 2.0 * (0.925 - 0.308 / 4.0)))], [])),
    Check("long-interface", above(10.0, "considerably"),
        lambda d: ([one("L/h_n", setting.L / setting.H)], [])),
    Check("rounded-weights", below(0.1, f"%: {TENTH}"),
        lambda d: ([over_ratios("change of tau_cr, root mean square", "%", lambda r:
                    estimates.root_mean_square(d.at("modes", "rounded", r)) * PER_CENT)], [])),
    Check("power-kept", rules.printed("0.9997"),
        lambda d: ([one("power kept", SPECTRUM.power_within(SPECTRUM.cutoff()))], [])),
    Claim("higher-modes", below(0.1, f"%: {TENTH}"),
        lambda d: ([over_ratios("change of tau_cr by them, root mean square", "%", lambda r:
                    estimates.root_mean_square(d.at("modes", "untruncated", r)) * PER_CENT)], [])),
    Check("enough-modes", below(0.1, f"%: {TENTH}"),
        lambda d: ([over_ratios("change of tau_cr with twice the modes of z", "%", lambda r:
                    estimates.root_mean_square(d.at("modes", "cut", r)) * PER_CENT)], [])),
    Claim("correlation-kept", below(0.05, "what one interface cannot show"),
        lambda d: ([over_ratios("largest difference of the two correlations", "", lambda r: Number(
            float(np.abs(d.at("theory", "correlation", r)
                         - d.at("theory", "gaussian_correlation", r)).max())))], [])),
    Claim("positive-correlation", graded(above(0.0), above(-0.1, "a tenth")),
        lambda d: ([over_ratios("smallest correlation on the period", "", lambda r:
                    Number(float(d.at("theory", "gaussian_correlation", r).min())))], [])),
    Check("fracture-energy-varies", above(0.0),
        lambda d: ([one("coefficient of variation of the fracture energy",
                        math.sqrt(_moment(4) - _moment(2) ** 2) / _moment(2))],
                   [one("mean fracture energy", _moment(2) / (2.0 * setting.W), "J/m²")])),
    Claim("enough-samples", each(below(0.1, f"%: {TENTH}"), below(2.0, "%: a line in a plot")),
        lambda d: ([over_ratios("error of the mean", "%", lambda r: _relative(mean, d, r)),
                    over_ratios("error of the standard deviation", "%",
                                lambda r: _relative(deviation, d, r))], [])),
]  # fmt: skip


def _moment(order: int) -> float:
    """Return the mean of a power of the strength."""
    return setting.MARGINAL.distribution.expect(lambda x: x**order)


def _relative(function, d: Data, ratio: float) -> Number:
    number = function(d.stress(ratio))
    return Number(PER_CENT * number.error / number.value * math.sqrt(d.size.samples / 10_000))


NUCLEATION = [
    Check("nucleation-mean", within(0.99, 1.01, SEEN),
        lambda d: ([over_ratios("<tau_n>/<tau_p>", "", lambda r: tau_n_moments(d, r)[0])], [])),
    Check("nucleation-variance", within(0.98, 1.02, "a line in a plot"),
        lambda d: ([over_ratios("sampled over integrated variance", "", lambda r:
                    _variance(d, r) * (1.0 / float(d.at("theory", "variance_ratio", r))))], [])),
    Claim("linear-variance", within(0.99, 1.01, SEEN),
        lambda d: ([one("logarithmic slope at xi_0 = h_n/50", _slope(d))],
                   [one("factor", float(d["theory"]["infinite"][0] / d["theory"]["ratio"][0]))])),
    Claim("long-variance", within(0.99, 1.01, SEEN),
        lambda d: ([one("variance ratio at xi_0 = 20 h_n, infinite interface",
                        float(d["theory"]["infinite"][-1]))],
                   [one("on this interface at 20 h_n", float(d["theory"]["periodic"][-1]))])),
    Claim("identity-limit", each(falling(), below(0.05, "a twentieth")),
        lambda d: _pair(over_ratios("root of 1 - Var[tau_n]/Var[tau_p]", "", lambda r: Number(
            math.sqrt(1.0 - infinite_variance_ratio(r))), (2.0, 4.0, 8.0, 16.0)), -1)),
    Claim("short-limit", each(rising(), below(0.2, "a fifth")),
        lambda d: _pair(over_ratios("standard deviation of tau_n over that of tau_p", "",
                        lambda r: Number(math.sqrt(infinite_variance_ratio(r))),
                        (0.02, 0.05, 0.1, 0.2)), 0)),
    Claim("nucleation-skewness", each(rising(), above(0.0)),
        lambda d: _pair(over_ratios("skewness of tau_n", "", lambda r: tau_n_moments(d, r)[2]), 0,
                        one("skewness of tau_p", POINT_SKEWNESS))),
    Claim("nearly-gaussian", below(0.5, "nearer to it than to the strength"),
        lambda d: ([Series("distance from a normal distribution, over that of the strength", "",
                           [(FIRST, _from_normal(d, FIRST))])],
                   [Series("the same", "", [(r, _from_normal(d, r)) for r in RATIOS[1:]])])),
    Claim("nucleation-extremes", each(falling(), rising()),
        lambda d: ([over_ratios("mean of min tau_n/<tau_p>", "", lambda r:
                    mean(d.at("moments", "least_tau_n", r) / MEAN)),
                    over_ratios("mean of max tau_n/<tau_p>", "", lambda r:
                    mean(d.at("moments", "largest_tau_n", r) / MEAN))], [])),
    Claim("weakest-point", rising(),
        lambda d: ([over_ratios("(min tau_p - tau_p,min)/<tau_p>, mean", "", lambda r:
                    mean((d.at("moments", "weakest_strength", r) - LOW) / MEAN))], [])),
    Claim("few-ties", below(0.1, "one interface in ten", share=True),
        lambda d: ([over_ratios("share of samples with a second minimum within 0.1 %", "",
                                lambda r: _ties(d, r, 0.001))],
                   [over_ratios("the same within 1 %", "", lambda r: _ties(d, r, 0.01))])),
]  # fmt: skip


def _pair(series: Series, index: int, *beside: Series):
    """Return a series and one of its numbers, each for a rule of its own."""
    chosen = [series.rows[index]]
    return [series, Series(series.label, series.unit, chosen)], list(beside)


def _variance(d: Data, ratio: float) -> Number:
    spread = tau_n_moments(d, ratio)[1]
    value = (spread.value * MEAN / DEVIATION) ** 2
    return Number(value, 2.0 * value * spread.error / spread.value)


def _ties(d: Data, ratio: float, gap: float) -> Number:
    second, least = (d.at("moments", name, ratio) for name in ("second_tau_n", "least_tau_n"))
    return share(second < (1.0 + gap) * least)


def _positions(d: Data, ratio: float) -> np.ndarray:
    return d.at("local", "critical_position", ratio) / setting.L


ONSET = [
    Claim("lower-friction", falling(),
        lambda d: ([over_ratios("mean tau_cr", "MPa", lambda r: mean(d.stress(r)) * MPA)],
                   [over_ratios("mean tau_cr, by ruptures", "MPa", lambda r:
                                mean(d.stress(r, "dynamic")) * MPA)] if "dynamic" in d else [])),
    Beyond("lower-friction-short", falling(), _beyond({"mean tau_cr": mean}, 0.0, 0.25)),
    Beyond("lower-friction-long", falling(), _beyond({"mean tau_cr": mean}, 2.0, 30.0)),
    Claim("variability", alike(rising()), lambda d: (spreads(d), [])),
    Claim("more-variability", alike(falling()), lambda d: (spreads(d), [])),
    Beyond("variability-short", alike(rising()), _beyond(MEASURES, 0.0, 0.25)),
    Beyond("variability-long", alike(rising()), _beyond(MEASURES, 2.0, 30.0)),
    Claim("vanishing-variability", alike(above(0.0)), lambda d: (_towards_zero(d), [])),
    Claim("short-stress", each(rising(), below(0.1, "a tenth")),
        lambda d: _pair(Series("1 - <tau_cr>/<tau_p>", "", [
            *((float(v.ratio), Number(1.0) - mean(v.values) * (1.0 / MEAN))
              for v in d["vanishing"]["stress"]),
            *((r, Number(1.0) - v) for r, v in trend(d, mean, 1.0 / MEAN)[:4])]), 0)),
    Claim("long-stress", each(falling(), below(0.01, SEEN)),
        lambda d: _pair(Series("mean of (tau_cr - min tau_p)/<tau_p>, L/xi_0 fixed", "",
                               _window(d, _excess)), -1)),
    Claim("density-of-minimum", each(falling(), rules.by_chance()),
        lambda d: ([Series("distance of the distributions", "",
                           _window(d, lambda *row: _apart(*row)[0])),
                    Series("p-value at the longest", "",
                           _window(d, lambda *row: _apart(*row)[1])[-1:])], [])),
    Claim("near-the-bound", alike(each(falling(), below(0.25, "the lower quarter", share=True))),
        _towards_bound),
    Claim("close-to-bound", below(0.25, "the lower quarter", share=True),
        lambda d: ([over_ratios("share of the way from lower to upper bound", "",
                                lambda r: _above_bound(mean(d.stress(r))))], [])),
    Claim("skewness-amplified", alike(each(falling(), above(0.0)), above(0.0)),
        lambda d: ([over_ratios("mean tau_cr", "MPa", lambda r: mean(d.stress(r)) * MPA),
                    over_ratios("<tau_p> less <tau_cr>, in deviations of tau_n", "", lambda r:
                                (Number(1.0) - mean(d.stress(r) / MEAN)) / tau_n_moments(d, r)[1]),
                    over_ratios("skewness of tau_cr less that of tau_n", "", lambda r:
                                estimates.skewness(d.stress(r)) - tau_n_moments(d, r)[2])], [])),
    Check("uniform-position", rules.by_chance(),
        lambda d: ([over_ratios("Kolmogorov-Smirnov p-value", "", lambda r:
                    Number(round(float(kstest(_positions(d, r), "uniform").pvalue), 3)))], [])),
    Claim("weakest-does-not-govern", above(0.01, "one interface in a hundred", share=True),
        lambda d: ([over_ratios("share with the onset more than h_n/2 from the weakest point", "",
                    lambda r: share(setting.distance(
                        d.at("local", "critical_position", r),
                        d.at("moments", "weakest_position", r)) > 0.5 * setting.H))], [])),
]  # fmt: skip


def dynamic_mean(d: Data, ratio: float) -> Number:
    """Return the mean tau_cr of ruptures, Pa: exact equilibrium of all samples, and the mean
    difference of the ruptures from it."""
    stress = d.stress(ratio, "ruptures")
    static = d.stress(ratio, "exact")
    extra, base = mean(stress - static[: stress.size]), mean(static)
    return Number(base.value + extra.value, math.hypot(base.error, extra.error))


def offsets(d: Data, ratio: float, study: str) -> np.ndarray:
    """Return a static prediction over the rupture of the same sample, less one."""
    stress = d.stress(ratio, "ruptures")
    return d.at(study, "first_instability", ratio)[: stress.size] / stress - 1.0


TWENTY = "what 20 simulations at a length cannot show"


def by_reading(function):
    """Return a measure: function(values) of each reading; values(name, ratio) has its samples."""
    return lambda d: {key: function(functools.partial(at, d, key)) for key in READINGS}


def _changes(v, index: int, label: str) -> Series:
    return over_ratios(label, "%", lambda r: abs(estimates.relative_changes(
        v("predicted", r), v("simulated", r))[index]) * PER_CENT, SIMULATED)  # fmt: skip


def _above_simulation(v, ratios=SIMULATED) -> Series:
    return over_ratios("theory above simulation, mean", "%",
                       lambda r: mean(v("excess", r)) * PER_CENT, ratios)  # fmt: skip


def _explained(d: Data) -> dict:
    label = f"share of the theory's error at {FIRST:g} that interaction explains"
    shares = by_reading(lambda v: [one(label, estimates.ratio_of_means(
        v("consistent_excess", FIRST), v("excess", FIRST)))])(d)  # fmt: skip
    rest = over_ratios("exact equilibrium against the ruptures, mean", "%", lambda r: abs(
        mean(offsets(d, r, "exact"))) * PER_CENT, SIMULATED)  # fmt: skip
    return {key: [*rows, rest] for key, rows in shares.items()}


PREDICTION = [
    Claim("good-prediction", below(1.0, "%: a third of what samples differ by"),
        lambda d: (by_reading(lambda v: [over_ratios("error, root mean square", "%", lambda r:
                       estimates.root_mean_square(v("excess", r)) * PER_CENT, SIMULATED)])(d),
                   [over_ratios("one modulus, against exact equilibrium of all samples", "%",
                       lambda r: estimates.root_mean_square(d.excess(r)) * PER_CENT),
                    over_ratios("one modulus, against the ruptures", "%", lambda r:
                       estimates.root_mean_square(offsets(d, r, "local")) * PER_CENT, SIMULATED)])),
    Claim("distribution-described", each(below(0.65, f"%: {TWENTY}"), below(16.0, f"%: {TWENTY}")),
        lambda d: (by_reading(lambda v: [
            _changes(v, 0, "error of the mean"),
            _changes(v, 1, "error of the standard deviation")])(d), [])),
    Claim("overpredicts",
        each(falling(), within(0.0, 1.0, "%: a third of what samples differ by")),
        lambda d: (by_reading(lambda v: [
                       _above_simulation(v), _above_simulation(v, SIMULATED[:1])])(d),
                   [over_ratios("one modulus, all samples", "%", lambda r:
                                mean(d.excess(r)) * PER_CENT)])),
    Claim("coincide", below(0.65, f"%: {TWENTY}"),
        lambda d: (by_reading(lambda v: [_above_simulation(v, SIMULATED[1:])])(d), [])),
    Claim("interaction-suffices",
        each(above(0.5, "most of it", share=True), below(0.1, f"%: {TENTH}")),
        lambda d: (_explained(d),
                   [Series("ruptures above equilibrium, by loading rate", "%", rate_offsets(d))])),
    Claim("simulations-trend", falling(),
        lambda d: ([over_ratios("mean tau_cr of exact equilibrium, shifted to the ruptures", "MPa",
                    lambda r: dynamic_mean(d, r) * MPA, SIMULATED)], [])),
    Claim("stress-still-right", above(0.875, "of the paper's 8 fewer than one is wrong",
                                      share=True),
        lambda d: (by_reading(lambda v: [one("share of the misplaced within 3 %", share(
            np.concatenate([v("excess", r)[v("misplaced", r)] for r in SIMULATED]) < 0.03))])(d),
            [])),
    Claim("wrong-positions-short", falling(),
        lambda d: (by_reading(lambda v: [over_ratios("share of onsets more than h_n/2 off", "",
                       lambda r: share(v("misplaced", r)), SIMULATED)])(d), [])),
    Check("applied-load", below(0.1, f"%: {TENTH}"),
        lambda d: ([over_ratios("applied load above the peak of the mean stress", "%", lambda r:
                    mean(d.at("ruptures", "applied_load", r) / d.stress(r, "ruptures") - 1.0)
                    * PER_CENT, SIMULATED)], [])),
]  # fmt: skip


def rate_offsets(d: Data) -> list[tuple[str, Number]]:
    """Return how far ruptures lie above equilibrium at each loading rate, %."""
    rows = d["convergence"]["offset"]
    return [
        (f"{float(case.split()[1]):g} times", mean(rows.sel(case=case).values) * PER_CENT)
        for case in rows.case.values.tolist() if case.startswith("rate")
    ]  # fmt: skip


def convergence(d: Data, case: str) -> float:
    """Return the largest change of tau_cr of a rupture with another grid or step, %."""
    stress = d["convergence"]["critical_stress"]
    change = stress.sel(case=case) / stress.sel(case="rate 1") - 1.0
    return PER_CENT * float(np.nanmax(np.abs(change)))


def bound_above(d: Data, ratio: float) -> np.ndarray:
    """Return the bound by the eigenvector of the grid over the exact onset, less one."""
    return d.at("moments", "bound", ratio) / d.at("exact", "first_instability", ratio) - 1.0


def stress_density(d: Data, ratio: float):
    """Return the density of tau_cr."""
    return st.statistics.density(d.stress(ratio), bounds=setting.DENSITY_BOUNDS)


GROUPS = {
    "Parameters and theory": PARAMETERS,
    "Nucleation stress": NUCLEATION,
    "Critical stress and position of onset": ONSET,
    "Theory against simulation": PREDICTION,
}
