"""Numbers that statements, texts and figures name. Most functions take the studies first.

Expressions in `statements.toml` and texts in `page.toml` name functions of this file.
"""

import math
from itertools import pairwise

import numpy as np
from scipy import stats
from scipy.special import ndtr

from reproduction import PARAMETERS, TEXTS, setting
from reproduction import numbers_with_errors as estimates
from reproduction.modulus import compare, odds  # noqa: F401  # named in statements.toml
from reproduction.numbers_with_errors import Number, lower_spread, mean, share
from reproduction.runner import Data, LeftOut
from reproduction.setting import FIRST, HIGH, LAST, LOW, MEAN, RATIOS, SIMULATED, H
from reproduction.studies import NORMAL, infinite_variance_ratio
from stiction.statistics.estimates import density

KPA, MPA = 1e-3, 1e-6
SPACING = setting.PROBLEM.interface.spacing
POINT_SKEWNESS = float(setting.MARGINAL.distribution.stats(moments="s"))
Rows = list[tuple[float | str, Number]]


def modulus_excess() -> float:
    """Return how far the printed modulus exceeds the modulus of plane stress, %."""
    if PARAMETERS:
        raise LeftOut("printed")
    return 100.0 * (setting.STRAIN.effective_modulus / setting.G_STAR - 1.0)


def relative_error(function, d: Data, ratio: float) -> float:
    """Return the relative error of a statistic of tau_cr from 10,000 samples, %."""
    number = function(d.stress(ratio))
    return 100.0 * number.error / number.value * math.sqrt(d.size.samples / 10_000)


# The nucleation stress


def tau_n_moments(d: Data, ratio: float) -> tuple[Number, Number, Number]:
    """Return mean and standard deviation over <tau_p>, and skewness, of tau_n."""
    shift, spread, skew = estimates.pooled_moments(d.at("moments", "powers", ratio))
    return shift + 1.0, spread, skew


def variance(d: Data, ratio: float) -> Number:
    """Return the sampled Var[tau_n]/Var[tau_p]."""
    spread = tau_n_moments(d, ratio)[1] * (MEAN / setting.DEVIATION)
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


def ties(d: Data, ratio: float, gap: float) -> Number:
    """Return the share of samples with a second minimum within a relative gap."""
    second, least = (d.at("moments", name, ratio) for name in ("second_tau_n", "least_tau_n"))
    return share(second < (1.0 + gap) * least)


# The onset


def trend(d: Data, function, factor: float, low: float = 0.0, high: float = np.inf) -> Rows:
    """Return a statistic of tau_cr over a part of the wide range of correlation lengths."""
    study = d["trend"]["critical_stress"].transpose("ratio", ...)
    rows = [(float(row.ratio), row.values) for row in study if low <= row.ratio <= high]
    return [(ratio, function(values) * factor) for ratio, values in rows]


def short_stress(d: Data) -> Rows:
    """Return 1 - <tau_cr>/<tau_p> towards vanishing correlation."""
    fine = d["vanishing"]["critical_stress"]
    rows = [(float(row.correlation_ratio), mean(row.values) / MEAN) for row in fine]
    rows += trend(d, mean, 1.0 / MEAN, high=0.5)
    return [(ratio, Number(1.0) - number) for ratio, number in rows]


def window(d: Data, function) -> Rows:
    """Return function(tau_cr, min tau_p) as h_n vanishes and L/xi_0 does not change."""
    study = d["window"]
    rows = zip(study.ratio.values, study.stress.values, study.weakest.values, strict=True)
    return [(float(ratio), function(stress, least)) for ratio, stress, least in rows]


def above_weakest(stress, weakest) -> Number:
    """Return the mean of tau_cr less the least strength, over <tau_p>."""
    return mean((stress - weakest) / MEAN)


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
    """Return the density of tau_cr."""
    return density(d.stress(ratio), bounds=setting.DENSITY_BOUNDS)


# Theory against simulation


def offsets(d: Data, ratio: float, study: str) -> np.ndarray:
    """Return a static prediction over the rupture of the same sample, less one."""
    stress = d.stress(ratio, "ruptures")
    return d.at(study, "first_instability", ratio)[: stress.size] / stress - 1.0


def dynamic_mean(d: Data, ratio: float) -> Number:
    """Return the mean tau_cr by equilibrium plus the mean difference of the ruptures, Pa."""
    stress, static = d.stress(ratio, "ruptures"), d.stress(ratio, "exact")
    return mean(static) + mean(stress - static[: stress.size])


def is_misplaced(d: Data, ratio: float, study: str = "local"):
    """Return simulated and predicted positions of onset, and whether they are h_n/2 apart."""
    place = d.at("ruptures", "critical_position", ratio)
    predicted = d.at(study, "critical_position", ratio)[: place.size]
    length = setting.PRINTED_H if study == "printed" else H
    return place, predicted, setting.distance(place, predicted) > 0.5 * length


def misplaced(d: Data, study: str = "local") -> int:
    """Return the number of ruptures whose onset a static method misplaces."""
    return sum(int(is_misplaced(d, ratio, study)[2].sum()) for ratio in SIMULATED)


def right_where_misplaced(v) -> Number:
    """Return the share of the misplaced onsets whose critical stress is right within 3 %."""
    return share(np.concatenate([v("excess", r)[v("misplaced", r)] for r in SIMULATED]) < 0.03)


def front_speed(d: Data) -> Number:
    """Return the median speed of the fronts of all ruptures over c_s, mean."""
    speeds = [d.at("ruptures", "median_rupture_speed", ratio) for ratio in SIMULATED]
    return mean(np.concatenate(speeds) / setting.PROBLEM.solid.shear_wave_speed)


# Patches


def growth(d: Data, steps: bool = False) -> Rows:
    """Return the number of slipping patches at shares of the onset, or its steps."""
    study = d["growth"]["patches"].sel(correlation_ratio=FIRST)
    rows = {x: study.sel(level=x).values for x in (0.92, 0.96, 0.999)}
    if steps:  # in the same samples
        return [(f"{b:g} less {a:g}", mean(rows[b] - rows[a])) for a, b in pairwise(rows)]
    return [(f"{x:g} tau_cr", mean(row)) for x, row in rows.items()]


def lowering(d: Data) -> Rows:
    """Return by how much a second dip lowers the onset, %."""
    study = d["mechanism"]["lowering"] * 100.0
    return [(f"{float(x.distance):g} h_n apart", Number(float(x))) for x in study]


# Arrest


def runaway_length(stress, key: str):
    """Return the length over h_n from which on no fracture energy suffices, in a reading."""
    modulus = setting.STRAIN.effective_modulus if key == "b" else setting.G_STAR
    length = H if key == "a" else setting.PRINTED_H
    drop = np.asarray(stress) - setting.residual(MEAN)
    return 4.0 * modulus * largest_energy() / (math.pi * drop**2) / length


def largest_energy() -> float:
    """Return the fracture energy of the strongest place, J/m²."""
    return (HIGH - setting.residual(HIGH)) ** 2 / (2.0 * setting.W)


def arrested(d: Data, ratio: float, study: str = "exact") -> Number:
    """Return the share of samples with an arrested event."""
    return share(d.at(study, "arrested_events", ratio) > 0)


def most_arrested(d: Data) -> tuple[float, Number]:
    """Return the xi_0/h_n with the most arrested samples without inertia, and their share, %."""
    shares = {ratio: arrested(d, ratio) * 100.0 for ratio in RATIOS}
    return max(shares.items(), key=lambda item: item[1].value)


def rarer(d: Data, study: str) -> Rows:
    """Return by how much the last share of arrested samples exceeds the first two."""
    shares = {ratio: arrested(d, ratio, study) for ratio in (*RATIOS[:2], LAST)}
    return [(f"less the share at {r:g}", shares[LAST] - shares[r]) for r in RATIOS[:2]]


def griffith(d: Data, name: str) -> Number:
    """Return the median over samples of the median length of their events over Griffith's."""
    edge = d["driving"].sel(case="edge")
    lengths = edge[name].values.reshape(edge.sizes["sample"], -1)
    ratios = lengths / edge["griffith"].values[:, : lengths.shape[1]]
    rows = [row[np.isfinite(row)] for row in ratios]
    medians = [np.median(row) for row in rows if row.size]
    low, high = np.quantile(medians, (0.25, 0.75))
    # A normal distribution has 1.349 deviations between its quartiles.
    error = 1.2533 * float(high - low) / 1.349 / math.sqrt(len(medians))
    return Number(float(np.median(medians)), error)


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


def so_many(d: Data, name: str, point: int) -> Number:
    """Return the chance of as many ruptures with an arrested event as at a point of a what-if."""
    events = d[f"{name}-inertia"]["arrested_events"].isel(point=point).values > 0
    return estimates.chance_of_so_many(events, arrested(d, setting.SECOND, "dynamic"))


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


# Words of the texts


def stress(d: Data, ratio: float) -> Number:
    """Return the mean tau_cr by the local criterion, MPa."""
    return mean(d.stress(ratio)) * MPA


def spread(d: Data, ratio: float) -> Number:
    """Return the median less the lower quartile of tau_cr, kPa."""
    return lower_spread(d.stress(ratio)) * KPA


def moves(d: Data, function, factor: float = 1.0, first=FIRST, last=LAST) -> str:
    """Return how a quantity changes from the first to the last correlation length, in words."""
    start, end = function(d, first) * factor, function(d, last) * factor
    change = end - start
    word = "falls" if change.value < 0.0 else "rises"
    word = word if abs(change.value) > 2.0 * change.error else "hardly changes"
    return f"{word} from {estimates.short(start)} to {estimates.short(end)}"
