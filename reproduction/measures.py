"""Numbers that statements, texts and figures name. Most functions take the studies first.

Expressions in `statements.toml` and texts in `page.toml` name functions of this file.
"""

import functools
import itertools
import math

import numpy as np
from scipy import stats
from scipy.special import ndtr

from reproduction import TEXTS, setting
from reproduction import numbers_with_errors as estimates
from reproduction.numbers_with_errors import Number, mean, share
from reproduction.runner import Data, LeftOut
from reproduction.setting import DROP, FIRST, HIGH, LAST, LOW, MEAN, RATIOS, SIMULATED, H
from reproduction.studies import NORMAL, READINGS, infinite_variance_ratio
from stiction.statistics import density

RESIDUAL = setting.RESIDUAL
SPACING = setting.PROBLEM.interface.spacing
POINT_SKEWNESS = float(setting.MARGINAL.distribution.stats(moments="s"))
Rows = list[tuple[float | str, Number]]


def relative_error(function, d: Data, ratio: float) -> float:
    """Return the relative error of a statistic of tau_cr - tau_r from 10,000 samples, %."""
    number = function(d.stress(ratio) - RESIDUAL)
    return 100.0 * number.error / number.value * math.sqrt(d.size.samples / 10_000)


# The nucleation stress


def tau_n_moments(d: Data, ratio: float) -> tuple[Number, Number, Number]:
    """Return mean and deviation of tau_n - tau_r over <tau_p - tau_r>, and skewness of tau_n."""
    shift, spread, skew = estimates.pooled_moments(d.at("moments", "powers", ratio))
    return shift + 1.0, spread, skew


def variance(d: Data, ratio: float) -> Number:
    """Return the sampled Var[tau_n]/Var[tau_p]."""
    spread = tau_n_moments(d, ratio)[1] * (DROP / setting.DEVIATION)
    return Number(spread.value**2, 2.0 * spread.value * spread.error)


def deviations(*ratios: float, remaining: bool = False) -> Rows:
    """Return the root of Var[tau_n]/Var[tau_p], or of the remaining share."""
    shares = [(ratio, infinite_variance_ratio(ratio)) for ratio in ratios]
    return [(r, Number(math.sqrt(1.0 - share if remaining else share))) for r, share in shares]


def from_normal(d: Data, ratio: float) -> Number:
    """Return the distance of tau_n from a normal distribution over that of tau_p."""
    rows = d.at("moments", "below", ratio)
    gaps = [abs(mean(row) - ndtr(z)) for row, z in zip(rows.T, NORMAL, strict=True)]
    below = setting.MARGINAL.distribution.cdf(MEAN + NORMAL * setting.DEVIATION)
    strength_gap = float(np.abs(below - ndtr(NORMAL)).max())
    return max(gaps, key=lambda gap: gap.value) / strength_gap


def if_skewed_low(number):
    """Return a number, which is left out if the strength is not skewed to low values."""
    if POINT_SKEWNESS < 0.1:
        raise LeftOut("skewness")
    return number


# The onset


def trend(d: Data, function, factor: float, low: float = 0.0, high: float = np.inf) -> Rows:
    """Return a statistic of tau_cr over a part of the wide range of correlation lengths."""
    study = d["trend"]["critical_stress"].transpose("ratio", ...)
    rows = [(float(row.ratio), row.values) for row in study if low <= row.ratio <= high]
    return [(ratio, function(values) * factor) for ratio, values in rows]


def short_stress(d: Data) -> Rows:
    """Return <tau_p - tau_cr>/<tau_p - tau_r> towards vanishing correlation."""
    rows = ((1 / 64, d.stress(1 / 64, "vanishing")), (FIRST, d.stress(FIRST)))
    return [(ratio, mean((MEAN - stress) / DROP)) for ratio, stress in rows]


def from_vanishing(d: Data, function, ratio: float = FIRST) -> Number:
    """Return a statistic of tau_cr less that at the shortest length of the vanishing range, Pa."""
    return function(d.stress(ratio)) - function(d["vanishing"]["critical_stress"][0])


def window(d: Data, function) -> Rows:
    """Return function(tau_cr, min tau_p) as h_n vanishes and L/xi_0 does not change."""
    study = d["window"]
    rows = zip(study.ratio.values, study.stress.values, study.weakest.values, strict=True)
    return [(float(ratio), function(stress, least)) for ratio, stress, least in rows]


def above_weakest(stress, weakest) -> Number:
    """Return the mean of tau_cr less the least strength, over <tau_p - tau_r>."""
    return mean((stress - weakest) / DROP)


def distance_of_halves(stress, weakest) -> Number:
    """Return how far the distributions of tau_cr and min tau_p of different samples differ."""
    half = stress.size // 2
    distance = stats.ks_2samp(stress[:half], weakest[half:]).statistic
    return Number(float(distance), 0.5 / math.sqrt(stress.size))


def p_of_halves(stress, weakest) -> Number:
    """Return the p-value of this distance."""
    half = stress.size // 2
    return Number(float(stats.ks_2samp(stress[:half], weakest[half:]).pvalue))


def towards_bound(stress, weakest=None) -> Number:
    """Return the share of the way from the lower to the upper bound of the strength."""
    return mean((stress - LOW) / (HIGH - LOW))


def stress_density(d: Data, ratio: float):
    """Return tau_cr, its density and error, smoothed in ln(tau_cr - tau_p,min), so 0 there."""
    bound = setting.SUPPORT[0]
    above = np.maximum(d.stress(ratio) - bound, 1e-9 * setting.DEVIATION)
    smooth = density(np.log(above))
    distance = np.exp(smooth.x)
    return bound + distance, smooth.value / distance, smooth.error / distance


# Theory against simulation


def paired(d: Data, ratio: float, study: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return a variable of the ruptures, and of the same samples of a static study.

    Samples in which an event is arrested are left out: equilibrium counts small jumps that a
    rupture passes over, so that their first events need not be the same.
    """
    moving, static = (d.at(k, "arrested_events", ratio) for k in ("ruptures", "exact"))
    whole = (moving == 0) & (static[: moving.size] == 0)
    return tuple(d.at(k, name, ratio)[: moving.size][whole] for k in ("ruptures", study))


def offsets(d: Data, ratio: float, study: str) -> np.ndarray:
    """Return a static prediction less the rupture of the same sample, over tau_cr - tau_r."""
    stress, predicted = paired(d, ratio, study, "critical_stress")
    return (predicted - stress) / (stress - RESIDUAL)


def largest_offset(d: Data, study: str) -> float:
    """Return the largest absolute value of these differences, %."""
    return 100.0 * max(np.abs(offsets(d, s, study)).max(initial=0.0) for s in SIMULATED)


def pairs(d: Data) -> int:
    """Return the number of ruptures in samples without an arrested event."""
    return sum(offsets(d, ratio, "exact").size for ratio in SIMULATED)


def dynamic_mean(d: Data, ratio: float) -> Number:
    """Return the mean tau_cr by equilibrium plus the mean difference of the ruptures, Pa."""
    stress, static = d.stress(ratio, "ruptures"), d.stress(ratio, "exact")
    return mean(static) + mean(stress - static[: stress.size])


def is_misplaced(d: Data, ratio: float, study: str = "local"):
    """Return simulated and predicted positions of onset, and whether they are h_n/2 apart."""
    place, predicted = paired(d, ratio, study, "critical_position")
    length = setting.PRINTED_H if study == "printed" else H
    return place, predicted, setting.distance(place, predicted) > 0.5 * length


def misplaced(d: Data, study: str = "local") -> int:
    """Return the number of ruptures whose onset a static method misplaces."""
    return sum(int(is_misplaced(d, ratio, study)[2].sum()) for ratio in SIMULATED)


def right_where_misplaced(v) -> Number:
    """Return the share of the misplaced onsets whose critical stress is right within 3 %."""
    return share(np.concatenate([v("excess", r)[v("misplaced", r)] for r in SIMULATED]) < 0.03)


def chance_of(v, least: int = 8) -> Number:
    """Return the chance of so many misplaced onsets or more, with 20 at each correlation length."""
    shares = [share(v("misplaced", ratio)) for ratio in SIMULATED]

    def chance(values) -> float:
        rows = [stats.binom.pmf(np.arange(21), 20, p) for p in values]
        return 1.0 - float(functools.reduce(np.convolve, rows)[:least].sum())

    values = np.array([number.value for number in shares])
    errors = np.diag([number.error for number in shares])
    changes = [chance(np.clip(values + row, 0.0, 1.0)) - chance(values) for row in errors]
    return Number(chance(values), math.hypot(*changes))


def shown(d: Data, name: str, unit: float = 1.0) -> Number:
    """Return a number of the rupture of Figure 3, left out if one of its events was arrested."""
    study = d["representative"]
    if study["arrested_events"] > 0 or name not in study:
        raise LeftOut("arrested")
    return Number(float(study[name]) / unit)


def front_speed(d: Data) -> Number:
    """Return the median speed of the fronts of all ruptures over c_s, mean."""
    speeds = [d.at("ruptures", "median_rupture_speed", ratio) for ratio in SIMULATED]
    return mean(np.concatenate(speeds) / setting.PROBLEM.solid.shear_wave_speed)


# Patches


def growth(d: Data, steps: bool = False) -> Rows:
    """Return the number of slipping patches on the way from tau_r to tau_cr, or its steps."""
    study = d["growth"]["patches"].sel(correlation_ratio=FIRST)
    rows = {x: study.sel(level=x).values for x in (0.92, 0.96, 0.999)}
    if steps:  # in the same samples
        pairs = itertools.pairwise(rows)
        return [(f"{b:g} less {a:g}", mean(rows[b] - rows[a])) for a, b in pairs]
    return [(f"{x:g}", mean(row)) for x, row in rows.items()]


def lowering(d: Data) -> Rows:
    """Return by how much a second dip lowers the onset, %."""
    study = d["mechanism"]["lowering"] * 100.0
    return [(f"{float(x.distance):g} h_n apart", Number(float(x))) for x in study]


# Arrest


def runaway_length(stress, key: str):
    """Return the length over h_n from which on no fracture energy suffices, in a reading."""
    modulus = setting.STRAIN.effective_modulus if key == "b" else setting.G_STAR
    length = H if key == "a" else setting.PRINTED_H
    drop = np.asarray(stress) - RESIDUAL
    return 4.0 * modulus * largest_energy() / (math.pi * drop**2) / length


def runaways(d: Data) -> list[Number]:
    """Return the smallest and the largest mean of this length over readings and xi_0/h_n."""
    keys = itertools.product(READINGS, SIMULATED)
    rows = [mean(runaway_length(d.reading(key, "simulated", s), key)) for key, s in keys]
    return [function(rows, key=lambda number: number.value) for function in (min, max)]


def energy_variation() -> float:
    """Return the coefficient of variation of the fracture energy."""
    second, fourth = (
        setting.MARGINAL.distribution.expect(lambda s, n=n: (s - RESIDUAL) ** n) for n in (2, 4)
    )
    return math.sqrt(fourth / second**2 - 1.0)


def largest_energy() -> float:
    """Return the fracture energy of the strongest place, J/m²."""
    return (HIGH - setting.residual(HIGH)) ** 2 / (2.0 * setting.W)


def arrested(d: Data, ratio: float, study: str = "exact") -> Number:
    """Return the share of samples with an arrested event."""
    return share(d.at(study, "arrested_events", ratio) > 0)


def arrested_again(d: Data, ratio: float) -> Number:
    """Return the share of samples that are arrested without inertia and with it."""
    events, usual = d["arrest"], arrested(d, ratio)
    again = events["dynamic"].values[events["ratio"].values == ratio] > 0
    part = share(again) if again.size else Number(1.0)
    error = math.hypot(usual.error * part.value, usual.value * part.error)
    return Number(usual.value * part.value, error)


def most_arrested(d: Data, function=arrested) -> tuple[float, Number]:
    """Return the xi_0/h_n with the most arrested samples, and their share, %."""
    shares = {ratio: function(d, ratio) * 100.0 for ratio in RATIOS}
    return max(shares.items(), key=lambda item: item[1].value)


def rarer(d: Data, function) -> Rows:
    """Return by how much the last share of arrested samples exceeds the first two."""
    last = function(d, LAST)
    return [(f"less the share at {r:g}", last - function(d, r)) for r in RATIOS[:2]]


def griffith(d: Data, name: str) -> Number:
    """Return the median over samples of the median length of their events over Griffith's."""
    edge = d["driving"].sel(case="edge")
    lengths = edge[name].values.reshape(edge.sizes["sample"], -1)
    expected = edge["griffith"].values[:, : lengths.shape[1]]  # infinite if nothing arrests
    ratios = np.where(np.isfinite(expected), lengths / expected, np.nan)
    medians = [np.nanmedian(row) for row in ratios if np.isfinite(row).any()]
    if not medians:
        raise LeftOut("griffith")
    return estimates.quantile(np.array(medians), 0.5)


# What if


def points(
    d: Data, name: str, function, factor=1.0, chosen=None, variable="critical_stress"
) -> Rows:
    """Return a statistic at points of a what-if, all or those chosen."""
    labels, values = TEXTS["points"][name.removesuffix("-inertia")], d[name][variable]
    chosen = range(len(labels)) if chosen is None else chosen
    return [(labels[i], function(values.isel(point=i).values) * factor) for i in chosen]


def arrest_shares(d: Data, name: str, chosen=None) -> Rows:
    """Return the share of samples with an arrested event at points of a what-if."""
    return points(d, name, lambda v: share(v > 0), 1.0, chosen, "arrested_events")


def so_many(d: Data, events) -> Number:
    """Return the chance of so many ruptures with arrested events if the strength alone varied."""
    return estimates.chance_of_so_many(np.greater(events, 0), arrested_again(d, setting.SECOND))


def skewed(d: Data, skew: int, ratio: float) -> np.ndarray:
    """Return tau_cr with the paper's strength (0) or its mirror image (1)."""
    return d["skewness"]["critical_stress"].isel(point=4 * skew + RATIOS.index(ratio)).values


def exponents(d: Data, index: int) -> Rows:
    """Return the change of the mean (0) or the standard deviation (1) by the exponent, %."""
    stress, labels = d["exponent"]["critical_stress"].values, TEXTS["points"]["exponent"]
    return [
        (label, abs(estimates.relative_changes(row, stress[i // 4 * 4 + 2])[index]) * 100.0)
        for i, (label, row) in enumerate(zip(labels, stress, strict=True))
        if i % 4 != 2
    ]


def moves(start: Number, end: Number) -> str:
    """Return how a stress changes, in words."""
    change = end - start
    word = "falls" if change.value < 0.0 else "rises"
    word = word if abs(change.value) > 2.0 * change.error else "hardly changes"
    return f"{word} from {estimates.si(start, 'Pa')} to {estimates.si(end, 'Pa')}"
