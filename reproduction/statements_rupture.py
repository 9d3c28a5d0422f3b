"""What the paper says of slip patches, arrest, size, and of how things would otherwise be."""

import dataclasses
import math

import numpy as np

from reproduction import numbers_with_errors, rules, setting
from reproduction.claims import Check, Claim, Data, Series, one, over_ratios
from reproduction.numbers_with_errors import Number, deviation, lower_spread, mean, share
from reproduction.rules import above, alike, below, each, falling, graded, rising, within
from reproduction.setting import HIGH, RATIOS, SIMULATED, H, L

KPA, MPA, PER_CENT = 1e-3, 1e-6, 100.0
RARE = below(0.01, "extremely unlikely: 60 simulations would not show it")
SLIGHT = below(0.05, "slightly: one sample in twenty")


def _levels(d: Data, name: str) -> list[tuple[str, Number]]:
    study = d["growth"][name].sel(correlation_ratio=RATIOS[0])
    return [
        (f"{level:g} tau_cr", mean(study.sel(level=level).values))
        for level in (0.92, 0.96, 0.999)
    ]


def _steps(d: Data) -> list[tuple[str, Number]]:
    study = d["growth"]["patches"].sel(correlation_ratio=RATIOS[0])
    at = {level: study.sel(level=level).values for level in (0.92, 0.96, 0.999)}
    pairs = ((0.92, 0.96), (0.96, 0.999))
    return [(f"{b:g} less {a:g} tau_cr", mean(at[b] - at[a])) for a, b in pairs]


def _near_length(d: Data, ratio: float) -> Number:
    length = d.at("exact", "critical_patch_length", ratio) / H
    slack = 0.1 + setting.PROBLEM.interface.spacing / H  # a patch has a whole number of nodes
    return share(np.abs(length - 1.0) <= slack)


def _help(d: Data, key: str) -> Number:
    return mean(d["mechanism"][key].values) * PER_CENT


PATCHES = [
    Claim("patches-grow", each(above(1.0), above(0.0)),
        lambda d: ([Series("slipping patches just below the onset, xi_0/h_n = 0.25", "",
                           _levels(d, "patches")[-1:]),
                    Series("increase", "", _steps(d))],
                   [Series("slipping patches", "", _levels(d, "patches"))])),
    Claim("patches-merge", above(0.01, "one interface in a hundred"),
        lambda d: ([one("share of samples whose critical patch merged, xi_0/h_n = 0.25",
                        share(d.at("growth", "merged", RATIOS[0])))],
                   [Series("mergers so far", "", _levels(d, "mergers"))])),
    Claim("not-the-first", above(0.01, "one interface in a hundred"),
        lambda d: ([one("share of critical patches without the weakest node, xi_0/h_n = 0.25",
                        share(d.at("growth", "holds_weakest", RATIOS[0]) == 0))], [])),
    Claim("critical-length", graded(above(0.95), above(0.5)),
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
    Claim("misplaced-by-neighbours", each(below(3.0, "%"), above(0.0)),
        lambda d: ([one("the two differ by", _help(d, "contest_wrong"), "%"),
                    one("more help than where the position is right",
                        _help(d, "helped_wrong") - _help(d, "helped_right"), "%")],
                   [one("help where misplaced", _help(d, "helped_wrong"), "%"),
                    one("help where right", _help(d, "helped_right"), "%")])),
    Check("load-like-strength", below(1e-6, "round-off of the solver"),
        lambda d: ([one("largest relative difference of tau_cr",
                        float(d["mechanism"]["exchange"]))], [])),
]  # fmt: skip


def _lowering(d: Data) -> Series:
    study = d["mechanism"]
    rows = zip(study.distance.values, study["lowering"].values * PER_CENT, strict=True)
    return Series("the onset falls by", "%", [(f"{x:g} h_n apart", Number(v)) for x, v in rows])


def runaway_length(stress):
    """Return the length in h_n at which the release rate exceeds the largest fracture energy."""
    energy = HIGH**2 / (2.0 * setting.W)
    return 4.0 * setting.G_STAR * energy / (math.pi * np.asarray(stress) ** 2) / H


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
    found = share(moving)
    error = math.hypot(still.error * found.value, still.value * found.error)
    return Number(still.value * found.value, error)


def _arrests(d: Data) -> list[Series]:
    return [over_ratios("share of samples with an arrested event, without inertia", "",
                        lambda r: arrested(d, r)),
            over_ratios("with inertia", "", lambda r: with_inertia(d, r))]  # fmt: skip


def _foreshocks(d: Data):
    study = "dynamic" if "dynamic" in d else "ruptures"
    found = d[study]["arrested_events"].values > 0
    return [one(f"share of {found.size:,} ruptures with an arrested event", share(found))], \
        _arrests(d)  # fmt: skip


ARREST = [
    Claim("runaway-length", within(2.5, 3.5, "about 3, as printed"),
        lambda d: ([over_ratios("length at which it does, over h_n", "", lambda r:
                    mean(runaway_length(d.stress(r))))], [])),
    Check("release-rate-grows", within(0.95, 1.05),
        lambda d: ([one("logarithmic slope from h_n to 3 h_n, periodic row of cracks",
                        math.log(math.tan(1.5 * math.pi * H / L) / math.tan(0.5 * math.pi * H / L))
                        / math.log(3.0))], [])),
    Check("longest-arrest", below(3.5),
        lambda d: ([one("longest arrested patch over h_n",
                        float(d["arrest"]["length"].max()) / H)] if d["arrest"].sizes["event"]
                   else [], [one("arrested samples looked at", d["arrest"].sizes["event"])])),
    Claim("both-sides", above(0.5, "more than at a random place"),
        lambda d: ([one("rank of the strength beside arrested patches, the weaker side, among"
                        " random places", mean(d["arrest"]["rank"]))]
                   if d["arrest"].sizes["event"] > 2 else [], [])),
    Claim("simulations-run-away", rules.never(0.1), _foreshocks),
    Claim("precursors-unlikely", each(RARE, RARE), lambda d: (_arrests(d), [])),
    Claim("arrest-beyond", each(RARE, below(0.0)),
        lambda d: ([_arrests(d)[0], one("share at 2 less share at 0.5, without inertia",
                    arrested(d, 2.0) - arrested(d, 0.5))], _arrests(d)[1:])),
    Claim("required", rules.never(0.01),
        lambda d: (_arrests(d)[:1], _arrests(d)[1:])),
    Claim("harder-arrest", rising(),
        lambda d: (_arrests(d)[1:], [_arrests(d)[0], over_ratios(
            "run-away length over h_n", "", lambda r: mean(runaway_length(d.stress(r))))])),
    Claim("shear-crack", rules.main(above(0.5), below(1.0, "shear waves")),
        lambda d: ([one("share of the patch at its residual strength once it is 6 h_n long",
                        float(d["representative"]["weakened"])),
                    one("median speed of the fronts over c_s", mean(np.concatenate(
                        [d.at("ruptures", "median_rupture_speed", r) for r in SIMULATED])
                        / setting.PROBLEM.solid.shear_wave_speed))], [])),
    Claim("systematic-driving", rules.main(above(0.5), above(0.5)),
        lambda d: ([_long_arrests(d, "edge"), _long_arrests(d, "gradient")],
                   [_long_arrests(d, "uniform"),
                    one("edge, with inertia, held", share(_edge_lengths(d) < 0.95 * L))])),
    Claim("griffith-arrest", rules.corrected(within(0.67, 1.5, "to a half")),
        lambda d: ([one("median length over Griffith's, edge load", _griffith(d, "length")),
                    one("with inertia, first event", _griffith(d, "dynamic_length"))], [])),
]  # fmt: skip


def _long_arrests(d: Data, case: str) -> Series:
    length = d["driving"]["length"].sel(case=case).values
    return one(f"share with an arrested front longer than 3 h_n, {case}",
               share(np.nanmax(np.nan_to_num(length), axis=1) > 3.0 * H))  # fmt: skip


def _edge_lengths(d: Data) -> np.ndarray:
    found = d["driving"]["dynamic_length"].sel(case="edge").values
    return found[np.isfinite(found)]


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


def _variation(values) -> Number:
    found = deviation(values)
    return found * (1.0 / float(np.mean(values)))


def _lengths(d: Data, function, factor: float) -> list[tuple[str, Number]]:
    rows = d["length"]["critical_stress"].values
    extents = (0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8)
    return [
        (f"{1e3 * x:g} mm", function(row) * factor)
        for x, row in zip(extents, rows, strict=True)
    ]


def _free(d: Data, function) -> Series:
    change = d["free_end"]["change"].values
    return over_ratios("change by free ends, mean", "%", lambda r: function(
        change[RATIOS.index(r)]) * PER_CENT)  # fmt: skip


def _near_end(d: Data, low: float, high: float) -> Number:
    """Return the share of onsets `low` to `high` h_n from an end, less that by chance, over all
    correlation lengths at one h_n."""
    end = d["free_end"]["end"].values[: len(RATIOS)]
    problem = dataclasses.replace(setting.PROBLEM, mode="III")
    chance = 2.0 * (high - low) * problem.nucleation_length / L
    return share((end >= low) & (end < high)) - chance


def _pressure(d: Data, function, chosen, variable: str = "friction_coefficient"):
    factors = ("1 MPa", "2 MPa", "4 MPa", "1 MPa", "4 MPa")
    return [(factors[i], function(d.what_if("normal_load", variable, i))) for i in chosen]


def _pressure_slope(d: Data) -> Number:
    values = [mean(d.what_if("normal_load", "critical_patch_length", i)) for i in (0, 1, 2)]
    slope = math.log(values[2].value / values[0].value) / math.log(4.0)
    relative = [number.error / number.value for number in (values[0], values[2])]
    return Number(slope, math.hypot(*relative) / math.log(4.0))


def _counted(d: Data) -> Series:
    study, rows = d["failure"], []
    for target in (1e-1, 1e-2):
        at = int(np.abs(np.log(study["probability"].values / target)).argmin())
        stress = float(study["stress"].values[at])
        plain, cv = share(d.stress(RATIOS[1]) < stress), float(study["cv"].values[at])
        value = float(study["probability"].values[at])
        found = Number(value, cv * value)
        rows.append((f"P = {target:g}", found / plain if plain.value else Number(math.nan)))
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
    Claim("free-end", rules.corrected(below(0.0)),
        lambda d: ([_free(d, mean)],
                   [over_ratios("share of samples lowered", "", lambda r: share(
                       d["free_end"]["change"].values[RATIOS.index(r)] < -1e-9))])),
    Claim("finite-size", rules.corrected(rising()),
        lambda d: ([Series("change by free ends, mean, xi_0/h_n = 0.25", "%", [
            (label, mean(d["free_end"]["change"].values[i]) * PER_CENT)
            for label, i in (("L/4", 4), ("L/2", 5), ("L", 0))])], [])),
    Claim("end-range",
        rules.corrected(each(above(0.0), within(-0.05, 0.05, "no effect beyond h_n"))),
        lambda d: ([one("share of onsets within h_n/2 of an end, less chance",
                        _near_end(d, 0.0, 0.5)),
                    one("from h_n to 2 h_n, less chance", _near_end(d, 1.0, 2.0))], [])),
    Check("length-against-pressure", within(-1.05, -0.95),
        lambda d: ([one("logarithmic slope of the critical patch", _pressure_slope(d))], [])),
    Claim("pressure-like-length", falling(),
        lambda d: ([Series("standard deviation over mean of the friction coefficient,"
                           " xi_0/h_n fixed", "", _pressure(d, _variation, (3, 1, 4)))],
                   [Series("with xi_0 fixed", "", _pressure(d, _variation, (0, 1, 2)))])),
    Check("failure-probability", within(0.5, 2.0, "to a factor of two"),
        lambda d: ([_counted(d)], [one("stress with P = 1e-6",
                   float(d["failure"]["stress"].values.min()) * MPA, "MPa")])),
]  # fmt: skip


def _mirrored(d: Data, function, factor: float, skew: int = 1):
    return over_ratios("mirrored distribution", "", lambda r: function(
        d.what_if("skewness", "critical_stress", 4 * skew + RATIOS.index(r))) * factor)  # fmt: skip


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


def _moving(d: Data, name: str, point: int) -> Number:
    """Return the share of ruptures with an arrested event at a point of a what-if."""
    return shares(d, name, (point,), inertia=True).rows[0][1]


def _triggered(d: Data):
    place = d.what_if("wide_strength", "event_position", 3)
    pairs = np.isfinite(place[:, :-1]) & np.isfinite(place[:, 1:])
    gap = setting.distance(place[:, :-1], place[:, 1:])[pairs]
    chance = 4.0 * H / L  # within 2 h_n to either side
    return [one("share of events within 2 h_n of the event before, less that by chance",
                share(gap < 2.0 * H) - chance)], [one("by chance", chance)]  # fmt: skip


WHAT_IF = [
    Claim("mirrored-variability", above(1.0),
        lambda d: ([over_ratios("median less lower quartile, mirrored over the paper's", "",
                    lambda r: lower_spread(d.what_if("skewness", "critical_stress",
                                                     4 + RATIOS.index(r)))
                    / lower_spread(d.what_if("skewness", "critical_stress", RATIOS.index(r))))],
                   [])),
    Claim("mirrored-trend", each(falling(), rising()),
        lambda d: ([_mirrored(d, mean, MPA), _mirrored(d, lower_spread, KPA)], [])),
    Claim("spectrum-minor", each(below(1.0, "%"), below(10.0, "%")),
        lambda d: ([_exponents(d, 0), _exponents(d, 1)], [])),
    Claim("wider-range", rules.main(rising(), SLIGHT, above(0.0)),
        lambda d: ([shares(d, "wide_strength"), shares(d, "wide_strength", (1,)),
                    one("four times the range, with inertia, less the paper's range",
                        _moving(d, "wide_strength", 3) - with_inertia(d, RATIOS[1]))], [])),
    Claim("cascade", rules.main(above(0.5, "one in every other sample"), above(0.0)),
        lambda d: ([one("arrested events a sample, four times the range, without inertia",
                        mean(d["wide_strength"]["arrested_events"].values[3].astype(float))),
                    one("share with one, with inertia", _moving(d, "wide_strength", 3))], [])),
    Claim("small-events-interact", above(0.0), _triggered),
    Claim("random-stress-drop", above(0.0),
        lambda d: ([one("134 kPa, short, without inertia, less random strength alone",
                        shares(d, "random_residual", (4,)).rows[0][1] - arrested(d, RATIOS[1])),
                    one("with inertia", _moving(d, "random_residual", 4)
                        - with_inertia(d, RATIOS[1]))], [shares(d, "random_residual")])),
    Claim("random-load", alike(below(0.05, "one sample in twenty")),
        lambda d: ([shares(d, "random_load", (i,)) for i in (4, 5)],
                   [shares(d, "random_load", inertia=True)])),
]  # fmt: skip


GROUPS = {
    "Slip patches and how they interact": PATCHES,
    "Run-away, arrest and what drives it": ARREST,
    "Size of the interface and of the scatter": SIZE,
    "What if": WHAT_IF,
}
