"""What the paper says of slip patches, arrest, size, and of how things would otherwise be."""

import dataclasses
import math
from itertools import pairwise

import numpy as np

from reproduction import numbers_with_errors, rules, setting
from reproduction.claims import Beyond, Check, Claim, Data, Series, one, over_ratios
from reproduction.modulus import at
from reproduction.numbers_with_errors import Number, deviation, lower_spread, mean, share
from reproduction.rules import above, alike, below, each, falling, graded, rising, within
from reproduction.setting import FIRST, HIGH, LAST, MEAN, RATIOS, SECOND, SIMULATED, H, L
from reproduction.statements_onset import KPA, MPA, PER_CENT, TWENTY, by_reading
from reproduction.studies import READINGS

MOST = above(0.5, "most of it", share=True)
RARE = below(0.01, "extremely unlikely: 60 simulations would not show it", share=True)


def _growth(d: Data):
    study = d["growth"]["patches"].sel(correlation_ratio=FIRST)
    rows = {level: study.sel(level=level).values for level in (0.92, 0.96, 0.999)}
    numbers = [(f"{level:g} tau_cr", mean(row)) for level, row in rows.items()]
    steps = [(f"{b:g} less {a:g} tau_cr", mean(rows[b] - rows[a])) for a, b in pairwise(rows)]
    text = f"slipping patches, xi_0/h_n = {FIRST:g}"
    return [Series(text, "", numbers[-1:]), Series("increase", "", steps)], \
        [Series(text, "", numbers), patches_at_onset(d)]  # fmt: skip


def patches_at_onset(d: Data) -> Series:
    """Return the number of slipping patches, of the samples of which growth is known and of all."""
    number = d.at("exact", "slip_patches", FIRST)
    few = d["growth"].sizes["sample"]
    rows = [(f"the same {few}", mean(number[:few])), ("all samples", mean(number))]
    return Series("at the onset itself", "", rows)


def _near_length(d: Data, ratio: float) -> Number:
    length = d.at("exact", "critical_patch_length", ratio) / H
    slack = 0.1 + setting.PROBLEM.interface.spacing / H  # a patch has a whole number of nodes
    return share(np.abs(length - 1.0) <= slack)


def _neighbours(v) -> list[Series]:
    """Return how close two places are where the onset is misplaced, and what interaction does."""
    wrong, helped = v("misplaced", FIRST), v("helped", FIRST) * PER_CENT
    if wrong.sum() < 2:
        return []
    contest = v("contest", FIRST)[wrong] * PER_CENT
    more = mean(helped[wrong]) - mean(helped[~wrong])
    return [one("the two differ by", mean(contest), "%"),
            one("more help than where the position is right", more, "%")]  # fmt: skip


PATCHES = [
    Claim("patches-grow", each(above(1.0), above(0.0)), _growth),
    Claim("patches-merge", above(0.01, "one interface in a hundred", share=True),
        lambda d: ([one(f"share of samples whose critical patch merged, xi_0/h_n = {FIRST:g}",
                        share(d.at("growth", "merged", FIRST)))], [])),
    Claim("not-the-first", above(0.01, "one interface in a hundred", share=True),
        lambda d: ([one(f"share of critical patches without the weakest node, xi_0/h_n = {FIRST:g}",
                        share(d.at("growth", "holds_weakest", FIRST) == 0))], [])),
    Claim("critical-length", graded(above(0.95, "nearly all", share=True), MOST),
        lambda d: ([over_ratios("share within 10 % and one node of h_n", "",
                                lambda r: _near_length(d, r))],
                   [over_ratios("95th percentile over h_n", "", lambda r: Number(float(
                       np.quantile(d.at("exact", "critical_patch_length", r) / H, 0.95))))])),
    Claim("patch-in-simulation", within(0.5, 1.5, "reasonable: to a half"),
        lambda d: ([one("length of the patch in the rupture of Figure 3 at the peak of the load,"
                        " over h_n", float(d["representative"]["patch_length"]) / H)], [])),
    Claim("residual-not-reached", rules.never(0.01),
        lambda d: ([over_ratios("share of samples that do, without an arrested event", "",
                    lambda r: share((d.at("exact", "residual_reached", r) > 0)
                                    & (d.at("exact", "arrested_events", r) == 0)))], [])),
    Claim("stress-beside", each(below(0.0), above(0.0)),
        lambda d: ([one("inside, of the load", float(d["mechanism"]["inside"]) * PER_CENT, "%"),
                    one("h_n/4 beside it", float(d["mechanism"]["beside"]) * PER_CENT, "%")], [])),
    Claim("neighbours-lower", each(falling(), above(0.0)),
        lambda d: ([_lowering(d), one("nearest", _lowering(d).rows[0][1], "%")], [])),
    Claim("misplaced-by-neighbours", each(below(3.0, "%: what samples differ by"), above(0.0)),
        lambda d: (by_reading(_neighbours)(d), [])),
    Check("load-like-strength", below(1e-6, "round-off of the solver"),
        lambda d: ([one("largest relative difference of tau_cr",
                        float(d["mechanism"]["exchange"]))], [])),
]  # fmt: skip


def _lowering(d: Data) -> Series:
    study = d["mechanism"]
    rows = zip(study.distance.values, study["lowering"].values * PER_CENT, strict=True)
    return Series("the onset falls by", "%", [(f"{x:g} h_n apart", Number(v)) for x, v in rows])


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


def with_inertia(d: Data, ratio: float) -> Number:
    """Return the share of samples with an arrested event, with inertia.

    By ruptures; or the share without inertia times the part of the first of these samples that a
    rupture arrests, too: inertia carries through, it does not arrest.
    """
    if "dynamic" in d:
        return arrested(d, ratio, "dynamic")
    still, events = arrested(d, ratio), d["arrest"]
    moving = events["dynamic"].values[events["ratio"].values == ratio] > 0
    if not moving.size:
        return Number(0.0, still.error)
    part = share(moving)
    error = math.hypot(still.error * part.value, still.value * part.error)
    return Number(still.value * part.value, error)


def _arrests(d: Data) -> list[Series]:
    return [over_ratios("share of samples with an arrested event, without inertia", "",
                        lambda r: arrested(d, r)),
            over_ratios("with inertia", "", lambda r: with_inertia(d, r))]  # fmt: skip


def _rarer(d: Data):
    """Return shares, and by how much the last exceeds the first two: by each measure."""
    rows = []
    for series, function in zip(_arrests(d), (arrested, with_inertia), strict=True):
        less = [(f"less that at {r:g}", function(d, LAST) - function(d, r)) for r in RATIOS[:2]]
        rows += [series, Series(f"share at {LAST:g}, {series.label.split(', ')[-1]}", "", less)]
    return rows, []


def _foreshocks(d: Data):
    study = "dynamic" if "dynamic" in d else "ruptures"
    events = d[study]["arrested_events"].values > 0
    return [one(f"share of {events.size:,} ruptures with an arrested event", share(events))], \
        _arrests(d)  # fmt: skip


ARREST = [
    Claim("runaway-length",
        graded(within(2.7, 3.3, "about 3: to a tenth"), within(2.0, 4.0, "to a third")),
        lambda d: ({key: [over_ratios("length at which it does, over h_n", "", lambda r, k=key:
                          mean(runaway_length(at(d, k, "simulated", r), k)), SIMULATED)]
                    for key in READINGS}, [])),
    Check("release-rate-grows", within(0.95, 1.05, "a twentieth"),
        lambda d: ([one("logarithmic slope from h_n to 3 h_n, periodic row of cracks",
                        math.log(math.tan(1.5 * math.pi * H / L) / math.tan(0.5 * math.pi * H / L))
                        / math.log(3.0))], [])),
    Check("longest-arrest", below(3.5),
        lambda d: ([one("longest arrested patch over h_n", float(d["arrest"]["length"].max()) / H)]
                   if d["arrest"].sizes["event"] else [], [])),
    Claim("both-sides", above(0.5),
        lambda d: ([one("rank of the strength beside arrested patches, the weaker side, among"
                        " random places", mean(d["arrest"]["rank"]))]
                   if d["arrest"].sizes["event"] > 2 else [], [])),
    Claim("simulations-run-away", rules.never(0.1), _foreshocks),
    Claim("precursors-unlikely", each(RARE, RARE), lambda d: (_arrests(d), [])),
    Claim("arrest-beyond", alike(each(RARE, below(0.0))), _rarer),
    Claim("required", rules.never(0.01), lambda d: (_arrests(d), [])),
    Claim("harder-arrest", alike(rising()), lambda d: (_arrests(d), [])),
    Claim("shear-crack", MOST,
        lambda d: ([one("share of a rupture at its residual strength once it is 6 h_n long",
                        mean(d["representative"]["weakened"]))],
                   [one("median speed of the fronts over c_s", mean(np.concatenate(
                        [d.at("ruptures", "median_rupture_speed", r) for r in SIMULATED])
                        / setting.PROBLEM.solid.shear_wave_speed))])),
    Claim("systematic-driving", MOST,
        lambda d: ([_long_arrests(d, "edge")],
                   [_long_arrests(d, "gradient"), _long_arrests(d, "uniform"),
                    one("edge, with inertia, held", share(d["driving"]["dynamic_length"].sel(
                        case="edge").dropna("sample") < 0.95 * L))])),
    Claim("griffith-arrest", rules.to_factor(1.5, "to a half"),
        lambda d: ([one("median length over Griffith's, edge load", _griffith(d, "length")),
                    one("with inertia, first event", _griffith(d, "dynamic_length"))],
                   [_single_events(d)])),
]  # fmt: skip


def _long_arrests(d: Data, case: str) -> Series:
    length = d["driving"]["length"].sel(case=case).values
    return one(f"share with an arrested front longer than 3 h_n, {case}",
               share(np.nanmax(np.nan_to_num(length), axis=1) > 3.0 * H))  # fmt: skip


def _griffith(d: Data, name: str) -> Number:
    edge = d["driving"].sel(case="edge")
    griffith = edge["griffith"].values
    if name == "length":
        quotient = edge["length"].values / griffith
    else:
        quotient = edge[name].values[:, None] / griffith[:, :1]
    rows = [np.median(row[np.isfinite(row)]) for row in quotient if np.isfinite(row).any()]
    low, high = np.quantile(rows, (0.25, 0.75))
    # A normal distribution has 1.349 deviations between its quartiles.
    error = 1.2533 * float(high - low) / 1.349 / math.sqrt(len(rows))
    return Number(float(np.median(rows)), error)


def _single_events(d: Data) -> Series:
    edge = d["driving"].sel(case="edge")
    known = np.isfinite(edge["length"]) & np.isfinite(edge["griffith"])
    quotient = (edge["length"] / edge["griffith"]).values[known]
    rows = [(f"{p:.0%}", numbers_with_errors.quantile(quotient, p)) for p in (0.05, 0.5, 0.95)]
    return Series("quantiles of single events, edge load", "", rows)


def _variation(values) -> Number:
    return deviation(values) * (1.0 / float(np.mean(values)))


def _lengths(d: Data, function, factor: float) -> list[tuple[str, Number]]:
    rows = d["length"]["critical_stress"].values
    extents = (0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8)
    return [
        (f"{1e3 * x:g} mm", function(row) * factor)
        for x, row in zip(extents, rows, strict=True)
    ]


def ends_change(d: Data, ratio: float) -> np.ndarray:
    """Return the change of tau_cr by free ends, %."""
    return d["free_end"]["change"].values[RATIOS.index(ratio)] * PER_CENT


SIZES = (("L/4", len(RATIOS), 0.25), ("L/2", len(RATIOS) + 1, 0.5), ("L", 0, 1.0))
"""Lengths at the shortest correlation, their cases in the study of free ends, their part of L."""


def _near_end(d: Data, low: float, high: float) -> Series:
    """Return the share of onsets `low` to `high` h_n from an end over that by chance."""
    length = dataclasses.replace(setting.PROBLEM, mode="III").nucleation_length
    rows = []
    for label, i, part in SIZES:
        end = d["free_end"]["end"].values[i]
        near = share((end >= low) & (end < high))
        rows.append((label, near * (part * L / (2.0 * (high - low) * length))))
    return Series(f"share of onsets {low:g} to {high:g} h_n from an end, over chance", "", rows)


def _by_size(d: Data):
    """Return changes by free ends, and what a straight line in h_n/L makes of them at zero."""
    rows = [
        (label, mean(d["free_end"]["change"].values[i]) * PER_CENT) for label, i, _ in SIZES
    ]
    value, error = np.transpose([(number.value, number.error) for _, number in rows])
    parts = [1.0 / part for *_, part in SIZES]
    line, covariance = np.polyfit(parts, value, 1, w=1.0 / error, cov="unscaled")
    limit = Number(float(line[1]), math.sqrt(covariance[1, 1]))
    return [Series(f"change by free ends, mean, xi_0/h_n = {FIRST:g}", "%", rows),
            one("as h_n/L vanishes, by a straight line", limit, "%")], []  # fmt: skip


def _pressure(d: Data, function, chosen, variable: str = "friction_coefficient"):
    factors = ("1 MPa", "2 MPa", "4 MPa", "1 MPa", "4 MPa")
    return [(factors[i], function(d.what_if("normal_load", variable, i))) for i in chosen]


def _pressure_slope(d: Data) -> Number:
    least, most = (mean(d.what_if("normal_load", "critical_patch_length", i)) for i in (0, 2))
    ratio = most / least
    return Number(math.log(ratio.value), ratio.error / ratio.value) * (1.0 / math.log(4.0))


def _counted(d: Data) -> Series:
    rows, study = [], d["failure"]
    for target in (1e-1, 1e-2):
        at = study.isel(point=int(np.abs(np.log(study["probability"] / target)).argmin()))
        plain = share(d.stress(SECOND) < float(at["stress"]))
        value, cv = float(at["probability"]), float(at["cv"])
        tail = Number(value, cv * value)
        rows.append((f"P = {target:g}", tail / plain if plain.value else Number(math.nan)))
    return Series("probability over that by counting", "", rows)


SIZE = [
    Claim("size-of-scatter",
        graded(above(0.2, "a quarter of the range over its middle"), above(0.02, "visible")),
        lambda d: ([over_ratios("coefficient of variation of tau_cr", "", lambda r:
                                _variation(d.stress(r)))],
                   [Series("at other lengths of the interface", "",
                           _lengths(d, _variation, 1.0))])),
    Claim("longer-interface", falling(),
        lambda d: ([Series("median less lower quartile", "kPa", _lengths(d, lower_spread, KPA))],
                   [Series("mean", "MPa", _lengths(d, mean, MPA))])),
    Claim("free-end", below(0.0),
        lambda d: ([over_ratios("change by free ends, mean", "%", lambda r:
                                mean(ends_change(d, r)))],
                   [over_ratios("share of samples lowered", "", lambda r:
                                share(ends_change(d, r) < -1e-7))])),
    Claim("finite-size", each(rising(), within(-0.65, 0.65, f"%: {TWENTY}")), _by_size),
    Claim("end-range", each(above(1.0), rules.to_factor(2.0, "less than nearer to the end")),
        lambda d: ([_near_end(d, 0.0, 0.5), _near_end(d, 1.0, 3.0)], [])),
    Check("length-against-pressure", within(-1.05, -0.95, "half a node of the shortest patch"),
        lambda d: ([one("logarithmic slope of the critical patch", _pressure_slope(d))], [])),
    Claim("pressure-like-length", falling(),
        lambda d: ([Series("standard deviation over mean of the friction coefficient,"
                           " xi_0/h_n fixed", "", _pressure(d, _variation, (3, 1, 4)))],
                   [Series("with xi_0 fixed", "", _pressure(d, _variation, (0, 1, 2)))])),
    Check("failure-probability", rules.to_factor(2.0, "far less than it varies by"),
        lambda d: ([_counted(d)], [one("stress with P = 1e-6",
                   float(d["failure"]["stress"].values.min()) * MPA, "MPa")])),
]  # fmt: skip


def skewed(d: Data, skew: int, ratio: float) -> np.ndarray:
    """Return tau_cr with the paper's strength (0) or its mirror image (1)."""
    return d.what_if("skewness", "critical_stress", 4 * skew + RATIOS.index(ratio))


def _exponents(d: Data, index: int) -> Series:
    labels = ("1.5", "2", "4", "8")
    rows = []
    for k, ratio in enumerate((0.25, 0.5, 2.0)):
        usual = d.what_if("exponent", "critical_stress", 4 * k + 2)
        for j in (0, 1, 3):
            other = d.what_if("exponent", "critical_stress", 4 * k + j)
            change = abs(numbers_with_errors.relative_changes(other, usual)[index]) * PER_CENT
            rows.append((f"exponent {labels[j]}, xi_0/h_n = {ratio:g}", change))
    return Series("mean" if index == 0 else "standard deviation", "%", rows)


CASES = {
    "wide_strength": ("the paper's range", "twice", "three times", "four times"),
    "random_load": ("long, 22 kPa", "long, 45 kPa", "long, 89 kPa", "long, 179 kPa",
                    "short, 45 kPa", "short, 179 kPa"),
    "random_residual": ("22 kPa, short", "22 kPa, long", "67 kPa, short", "67 kPa, long",
                        "134 kPa, short", "134 kPa, long"),
}  # fmt: skip
"""What the points of a what-if are called."""


def shares(d: Data, name: str, chosen=None, *, inertia: bool = False) -> Series:
    """Return the share of samples with an arrested event at points of a what-if."""
    label = f"share with an arrested event, {'with' if inertia else 'without'} inertia"
    events = d[f"{name}-inertia" if inertia else name]["arrested_events"]
    if inertia:
        label += f" ({events.sizes['sample']} ruptures each)"
    chosen = chosen or range(len(CASES[name]))
    rows = zip(events["point"].values, events.values > 0, strict=True)
    return Series(label, "", [(CASES[name][i], share(row)) for i, row in rows if i in chosen])


def _many(d: Data, name: str, point: int) -> Series:
    """Return the chance of so many ruptures with an arrested event as at a point of a what-if."""
    row = d[f"{name}-inertia"]["arrested_events"].sel(point=point).values > 0
    text = f"chance of {row.sum()} of {row.size} ruptures, with the strength of the paper alone"
    chance = numbers_with_errors.chance_of_so_many(row, with_inertia(d, SECOND))
    return one(text, chance)


def _triggered(d: Data):
    place = d.what_if("wide_strength", "event_position", 3)
    rows = []
    for row in (row[np.isfinite(row)] for row in place):
        near = setting.distance(row[:, None], row) < 2.0 * H
        if row.size > 2:
            rows.append((np.diag(near, 1).mean(), near[np.triu_indices(row.size, 1)].mean()))
    if len(rows) < 3:
        return [], []
    following, any_two = np.transpose(rows)
    label = "share within 2 h_n of the event before, less that of any two of an interface"
    return [one(label, mean(following - any_two))], [
        one("of any two", mean(any_two)), one("of random places", 4.0 * H / L)]  # fmt: skip


def _random_load(point: int):
    """Return a measure: the share of samples with an arrested event, with inertia beside it."""
    return lambda d: ([shares(d, "random_load", (point,))],
                      [shares(d, "random_load", (point,), inertia=True)])  # fmt: skip


WHAT_IF = [
    Claim("mirrored-variability", above(1.0),
        lambda d: ([over_ratios("median less lower quartile, mirrored over the paper's", "",
                    lambda r: lower_spread(skewed(d, 1, r)) / lower_spread(skewed(d, 0, r)))],
                   [])),
    Claim("mirrored-trend", rules.main(each(falling(), rising()), above(0.0)),
        lambda d: ([over_ratios("mean, mirrored distribution", "MPa", lambda r:
                                mean(skewed(d, 1, r)) * MPA),
                    over_ratios("median less lower quartile, mirrored distribution", "kPa",
                                lambda r: lower_spread(skewed(d, 1, r)) * KPA),
                    one("from 0.25 to 2 the latter rises with the paper's strength by", (
                        lower_spread(skewed(d, 0, 2.0)) - lower_spread(skewed(d, 0, 0.25))) * KPA,
                        "kPa")], [])),
    Claim("spectrum-minor", each(below(1.0, "%"), below(10.0, "%")),
        lambda d: ([_exponents(d, 0), _exponents(d, 1)], [])),
    Claim("wider-range", each(rising(), rules.unlikely()),
        lambda d: ([shares(d, "wide_strength"), _many(d, "wide_strength", 3)], [])),
    Claim("cascade", each(above(0.5, "one in every other sample"), rules.unlikely()),
        lambda d: ([one("arrested events a sample, four times the range, without inertia",
                        mean(d["wide_strength"]["arrested_events"].values[3].astype(float))),
                    _many(d, "wide_strength", 3)], [])),
    Claim("small-events-interact", above(0.0), _triggered),
    Claim("random-stress-drop", each(above(0.0), rules.unlikely()),
        lambda d: ([one("134 kPa, short, without inertia, less random strength alone",
                        shares(d, "random_residual", (4,)).rows[0][1] - arrested(d, SECOND)),
                    _many(d, "random_residual", 4)], [shares(d, "random_residual")])),
    Claim("random-load", below(0.05, "one sample in twenty", share=True), _random_load(4)),
    Beyond("strong-random-load", below(0.05, "one sample in twenty", share=True),
        _random_load(5)),
]  # fmt: skip


GROUPS = {
    "Slip patches and how they interact": PATCHES,
    "Run-away, arrest and what drives it": ARREST,
    "Size of the interface and of the scatter": SIZE,
    "What if": WHAT_IF,
}
