"""What the paper says of slip patches, arrest, size, and of how things would otherwise be."""

import dataclasses
import math

import numpy as np

from reproduction import numbers_with_errors, rules, setting
from reproduction.claims import Check, Claim, Data, Series, one, over_ratios
from reproduction.numbers_with_errors import Number, deviation, lower_spread, mean, share
from reproduction.rules import above, below, corrected, each, falling, graded, rising, within
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
    Claim("patches-grow", "Many patches slip at once, and their number grows with the load.",
        "Abstract, sentence 5; Sec. 5.2, par. 1, sentences 1 and 3", each(above(1.0), above(0.0)),
        lambda d: ([Series("slipping patches just below the onset, xi_0/h_n = 0.25", "",
                           _levels(d, "patches")[-1:]),
                    Series("increase", "", _steps(d))],
                   [Series("slipping patches", "", _levels(d, "patches"))])),
    Claim("patches-merge", "Patches may merge, the critical one among them.",
        "Sec. 5.2, par. 1, sentence 4", above(0.01, "one interface in a hundred"),
        lambda d: ([one("share of samples whose critical patch merged, xi_0/h_n = 0.25",
                        share(d.at("growth", "merged", RATIOS[0])))],
                   [Series("mergers so far", "", _levels(d, "mergers"))])),
    Claim("not-the-first", "The patch that becomes unstable need not be the first to appear.",
        "Sec. 5.2, par. 1, sentence 5", above(0.01, "one interface in a hundred"),
        lambda d: ([one("share of critical patches without the weakest node, xi_0/h_n = 0.25",
                        share(d.at("growth", "holds_weakest", RATIOS[0]) == 0))], [])),
    Claim("critical-length", "The critical patch is h_n long, whatever the profile of strength.",
        "Sec. 3.2, par. 2, sentences 3 to 5; App. A, par. 4, sentence 2",
        graded(above(0.95), above(0.5)),
        lambda d: ([over_ratios("share within 10 % of h_n", "", lambda r: _near_length(d, r))],
                   [over_ratios("95th percentile over h_n", "", lambda r: Number(float(
                       np.quantile(d.at("exact", "critical_patch_length", r) / H, 0.95))))]),
        note="longer where patches merge"),
    Claim("patch-in-simulation", "h_n predicts the size of the patch in the simulation reasonably.",
        "Sec. 3.3, par. 2, sentence 2", within(0.5, 1.5, "reasonable: to a half"),
        lambda d: ([one("length of the patch in the rupture of Figure 3 at the peak of the load,"
                        " over h_n", float(d["representative"]["patch_length"]) / H)], [])),
    Claim("residual-not-reached", "No point reaches its residual strength before the onset; the"
        " criterion of small-scale yielding does not apply.",
        "Sec. 3.2, par. 2, sentence 1; par. 3, sentences 5 and 6", rules.never(0.01),
        lambda d: ([over_ratios("share of samples that do, without an arrested event", "",
                    lambda r: share((d.at("exact", "residual_reached", r) > 0)
                                    & (d.at("exact", "arrested_events", r) == 0)))], [])),
    Claim("stress-beside", "A patch lowers the stress inside it and raises it beside it.",
        "Sec. 5.2, par. 3, sentence 6", each(below(0.0), above(0.0)),
        lambda d: ([one("inside, of the load", float(d["mechanism"]["inside"]) * PER_CENT, "%"),
                    one("h_n/4 beside it", float(d["mechanism"]["beside"]) * PER_CENT, "%")], [])),
    Claim("neighbours-lower", "A near patch makes another one unstable at a lower load.",
        "Sec. 5.2, par. 3, sentences 5 and 7", each(falling(), above(0.0)),
        lambda d: ([_lowering(d), one("nearest", _lowering(d).rows[0][1], "%")], []),
        note="two dips of the strength, which the local criterion takes for one"),
    Claim("misplaced-by-neighbours",
        "Where the position is misplaced, two patches have very similar"
        " critical stress, and the less critical one is helped by a neighbour.",
        "Sec. 5.2, par. 4, sentences 3 and 4", each(below(3.0, "%"), above(0.0)),
        lambda d: ([one("the two differ by", _help(d, "contest_wrong"), "%"),
                    one("more help than where the position is right",
                        _help(d, "helped_wrong") - _help(d, "helped_right"), "%")],
                   [one("help where misplaced", _help(d, "helped_wrong"), "%"),
                    one("help where right", _help(d, "helped_right"), "%")])),
    Check("load-like-strength", "A non-uniform load on uniform strength, and a uniform load on"
        " non-uniform strength, are one problem.", "Sec. 3.2, par. 1, sentences 4 and 5",
        below(1e-6, "round-off of the solver"),
        lambda d: ([one("largest relative difference of tau_cr",
                        float(d["mechanism"]["exchange"]))], [])),
    Check("one-accelerates", "Most patches grow slowly until the onset; one becomes unstable.",
        "Sec. 5.2, par. 1, sentence 3", above(1.0),
        lambda d: ([one("patches at the onset, xi_0/h_n = 0.25",
                        mean(d.at("exact", "slip_patches", RATIOS[0])))], []),
        note="one by definition: the onset is the first moment at which one accelerates"),
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


def _arrests(d: Data) -> list[Series]:
    found = [over_ratios("share of samples with an arrested event, without inertia", "",
                         lambda r: arrested(d, r))]  # fmt: skip
    if "dynamic" in d:
        found.append(over_ratios(f"with inertia, {d.size.dynamic:,} ruptures each", "",
                                 lambda r: arrested(d, r, "dynamic")))  # fmt: skip
    else:
        found.append(one("of those, arrested with inertia", share(d["arrest"]["dynamic"] > 0)))
    return found


def _foreshocks(d: Data):
    study = "dynamic" if "dynamic" in d else "ruptures"
    ratios = RATIOS if study == "dynamic" else SIMULATED
    found = over_ratios("share of ruptures with an arrested event", "",
                        lambda r: arrested(d, r, study), ratios)  # fmt: skip
    return [found], _arrests(d)[:1]


ARREST = [
    Claim("runaway-length",
        "A rupture longer than about 3 h_n cannot be arrested: its static energy"
        " release rate exceeds the largest fracture energy.",
        "Sec. 5.2, par. 5, sentences 9 and 10", within(2.5, 3.5, "about 3, as printed"),
        lambda d: ([over_ratios("length at which it does, over h_n", "", lambda r:
                    mean(runaway_length(d.stress(r))))], [])),
    Check("release-rate-grows", "The static energy release rate grows in proportion to the length.",
        "Sec. 5.2, par. 5, sentence 8", within(0.95, 1.05),
        lambda d: ([one("logarithmic slope from h_n to 3 h_n, periodic row of cracks",
                        math.log(math.tan(1.5 * math.pi * H / L) / math.tan(0.5 * math.pi * H / L))
                        / math.log(3.0))], [])),
    Check("longest-arrest", "Shorter than about 3 h_n a rupture may be arrested.",
        "Sec. 5.2, par. 5, sentences 10 and 11", within(0.0, 3.5),
        lambda d: ([one("longest arrested patch over h_n",
                        float(d["arrest"]["length"].max()) / H)] if d["arrest"].sizes["event"]
                   else [], [one("arrested samples looked at", d["arrest"].sizes["event"])])),
    Claim("both-sides", "Arrest needs a large rise of the strength on both sides at once.",
        "Sec. 5.2, par. 5, sentence 12", above(0.5, "more than at a random place"),
        lambda d: ([one("rank of the strength beside arrested patches, the weaker side, among"
                        " random places", mean(d["arrest"]["rank"]))]
                   if d["arrest"].sizes["event"] > 2 else [], []),
        note="largest strength within h_n/2 of each end; 0.5 is chance"),
    Claim("simulations-run-away", "In every simulation the rupture, once unstable, runs along the"
        " whole interface.", "Sec. 5.2, par. 5, sentences 1 and 2", rules.never(0.1), _foreshocks),
    Claim("precursors-unlikely",
        "Random strength alone makes precursory events extremely unlikely.",
        "Abstract, sentence 10; Sec. 5.2, par. 5, sentence 13; Sec. 6, par. 1, sentence 9", RARE,
        lambda d: (_arrests(d)[:1], _arrests(d)[1:])),
    Claim("arrest-beyond", "Arrest is very unlikely, in particular for xi_0 > h_n.",
        "Sec. 5.2, par. 5, sentence 12", each(RARE, below(0.0)),
        lambda d: ([_arrests(d)[0], one("share at 2 less share at 0.5",
                    arrested(d, 2.0) - arrested(d, 0.5))], _arrests(d)[1:]),
        note="most frequent at h_n/2"),
    Claim("harder-arrest",
        "A higher critical stress at shorter correlation length makes arrest more"
        " difficult.", "Sec. 5.4, par. 3, sentence 2", rising(),
        lambda d: ([_arrests(d)[0]],
                   [over_ratios("run-away length over h_n", "", lambda r:
                                mean(runaway_length(d.stress(r)))), *_arrests(d)[1:]]),
        note="the run-away length is shorter, as the paper argues, and yet arrest is more frequent"
        " than at 2 h_n: strength that varies over shorter lengths stops more"),
    Claim("shear-crack", "After some growth the slipping area is a shear crack with a constant"
        " residual strength and a cohesive zone.", "Sec. 5.2, par. 5, sentence 5",
        rules.main(above(0.5), below(1.0, "slower than shear waves")),
        lambda d: ([one("share of the patch at its residual strength once it is 6 h_n long",
                        float(d["representative"]["weakened"])),
                    one("median speed of the fronts over c_s", mean(np.concatenate(
                        [d.at("ruptures", "median_rupture_speed", r) for r in SIMULATED])
                        / setting.PROBLEM.solid.shear_wave_speed))], []),
        note="one rupture for the share; fronts are supershear, where the static energy balance no"
        " longer decides"),
    Claim("pre-slip", "Nucleation is of the pre-slip type: slow slip and one acceleration.",
        "Sec. 5.4, par. 4, sentence 4", below(0.1, "60 simulations would show more"), _foreshocks),
    Claim("systematic-driving",
        "Arrested fronts of experiments come from non-uniform loading by the"
        " set-up.", "Abstract, sentence 11; Sec. 5.2, par. 7, sentence 2",
        rules.main(above(0.5), above(0.5)),
        lambda d: ([_long_arrests(d, "edge"), _long_arrests(d, "gradient")],
                   [_long_arrests(d, "uniform"),
                    one("edge, with inertia, held", share(_edge_lengths(d) < 0.95 * L))]),
        note="fronts longer than 3 h_n: an edge makes them in every sample, a gradient seldom"),
    Claim("griffith-arrest", "Arrest follows from the balance of energy release rate and fracture"
        " energy.", "Sec. 5.2, par. 5, sentence 6", corrected(within(0.67, 1.5, "to a half")),
        lambda d: ([one("median length over Griffith's, edge load", _griffith(d, "length")),
                    one("with inertia, first event", _griffith(d, "dynamic_length"))], []),
        note="in the median; single events scatter from near zero to 1.3 times"),
    Check("larger-earthquakes", "A higher stress at the onset means a larger stress drop.",
        "Sec. 5.4, par. 3, sentence 2", falling(),
        lambda d: ([over_ratios("stress drop of the ruptures, mean", "MPa", lambda r:
                    mean(d.at("ruptures", "stress_drop", r)) * MPA, SIMULATED)], []),
        note="with tau_r = 0 the drop is tau_cr; an interface that slides as a"
        " whole has no magnitude"),
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


def _near_end(d: Data) -> Number:
    end = d["free_end"]["end"].values[: len(RATIOS)]
    problem = dataclasses.replace(setting.PROBLEM, mode="III")
    return share(end < 0.5) - problem.nucleation_length / L


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
        plain = share(d.stress(RATIOS[1]) < stress)
        found = Number(float(study["probability"].values[at]),
                       float(study["probability"].values[at]) * 0.2)  # fmt: skip
        rows.append((f"P = {target:g}", found / plain if plain.value else Number(math.nan)))
    return Series("probability over that by counting", "", rows)


SIZE = [
    Claim("size-of-scatter", "Random local strength may be the origin of scatter of friction"
        " coefficients such as from 0.32 to 0.80.",
        "Sec. 1, par. 2, sentence 3; par. 4, sentence 1",
        graded(above(0.2, "a quarter of the range over its middle"), above(0.02, "visible")),
        lambda d: ([over_ratios("coefficient of variation of tau_cr", "", lambda r:
                                _variation(d.stress(r)))],
                   [Series("at other lengths of the interface", "",
                           _lengths(d, _variation, 1.0))]),
        note="an origin, but with the paper's strength of a tenth of that size. The quoted range"
        " would need a shorter interface and a wider strength"),
    Claim("longer-interface", "A longer interface makes the critical stress vary less.",
        "Sec. 5.3, par. 4, sentence 3", falling(),
        lambda d: ([Series("median less lower quartile", "kPa", _lengths(d, lower_spread, KPA))],
                   [Series("mean", "MPa", _lengths(d, mean, MPA))])),
    Claim("free-end", "A free end lowers the critical stress locally.",
        "Sec. 5.1, par. 6, sentence 2", corrected(below(0.0)), lambda d: ([_free(d, mean)], []),
        note="shown in mode III, where a mirrored field has free ends exactly; the paper is in"
        " mode II"),
    Claim("periodic-higher", "The distribution of a periodic interface tends slightly to higher"
        " values than that of a finite one.", "Sec. 5.1, par. 6, sentence 3",
        corrected(below(0.0)),
        lambda d: ([_free(d, mean)],
                   [over_ratios("share of samples lowered", "", lambda r: share(
                       d["free_end"]["change"].values[RATIOS.index(r)] < -1e-9))]),
        note="shown in mode III; in some samples the end strengthens: there is one neighbour less"),
    Claim("finite-size", "As h_n/L tends to zero, the distribution tends to that of the periodic"
        " interface.", "Sec. 5.1, par. 6, sentence 4", corrected(rising()),
        lambda d: ([Series("change by free ends, mean, xi_0/h_n = 0.25", "%", [
            (label, mean(d["free_end"]["change"].values[i]) * PER_CENT)
            for label, i in (("L/4", 4), ("L/2", 5), ("L", 0))])], []), note="shown in mode III"),
    Claim("end-range", "The range of the effect of an end scales with h_n.",
        "Sec. 5.1, par. 6, sentence 4", corrected(above(0.0)),
        lambda d: ([one("share of onsets within h_n/2 of an end, above chance", _near_end(d))], []),
        note="shown in mode III"),
    Check("length-against-pressure", "The nucleation length is inversely proportional to"
        " tau_p - tau_r as pressure changes.", "Sec. 5.3, par. 4, sentence 4",
        within(-1.05, -0.95),
        lambda d: ([one("logarithmic slope of the critical patch", _pressure_slope(d))], []),
        note="d_c fixed"),
    Claim("pressure-like-length", "More normal load acts like a longer interface: less variation.",
        "Sec. 5.3, par. 4, sentences 3 and 4", falling(),
        lambda d: ([Series("standard deviation over mean of the friction coefficient,"
                           " xi_0/h_n fixed", "", _pressure(d, _variation, (3, 1, 4)))],
                   [Series("with xi_0 fixed", "", _pressure(d, _variation, (0, 1, 2)))]),
        note="xi_0/h_n held fixed, so that h_n/L alone changes"),
    Check("failure-probability", "The framework gives the failure probability of an interface of"
        " known strength.", "Sec. 5.3, par. 1, sentence 2", within(0.4, 1.6, "to a half"),
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
    "correlation": tuple(f"{rho:g} at {r:g} h_n" for rho in (-0.8, -0.4, 0.0, 0.4, 0.8, 1.0)
                         for r in (0.5, 2.0)),
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


def _both(name: str, *chosen: int):
    """Judge by inertia, with equilibrium beside it."""
    return lambda d: ([shares(d, name, chosen, inertia=True)], [shares(d, name)])


def events_a_sample(d: Data, *, inertia: bool) -> Number:
    """Return the number of arrested events of a sample at four times the range of strength."""
    name = "wide_strength-inertia" if inertia else "wide_strength"
    return mean(d[name]["arrested_events"].values[-1].astype(float))


def _triggered(d: Data):
    place = d.what_if("wide_strength", "event_position", 3)
    pairs = np.isfinite(place[:, :-1]) & np.isfinite(place[:, 1:])
    gap = setting.distance(place[:, :-1], place[:, 1:])[pairs]
    chance = 4.0 * H / L  # within 2 h_n to either side
    return [one("share of events within 2 h_n of the event before, less that by chance",
                share(gap < 2.0 * H) - chance)], [one("by chance", chance)]  # fmt: skip


WHAT_IF = [
    Claim("mirrored-variability", "Strength skewed to high values would make tau_cr vary more.",
        "Sec. 5.3, par. 2, sentence 6", above(1.0),
        lambda d: ([over_ratios("median less lower quartile, mirrored over the paper's", "",
                    lambda r: lower_spread(d.what_if("skewness", "critical_stress",
                                                     4 + RATIOS.index(r)))
                    / lower_spread(d.what_if("skewness", "critical_stress", RATIOS.index(r))))],
                   [])),
    Claim("mirrored-trend", "With the other skewness, too, a shorter correlation means a higher"
        " tau_cr that varies less.", "Sec. 5.3, par. 2, sentence 7", each(falling(), rising()),
        lambda d: ([_mirrored(d, mean, MPA), _mirrored(d, lower_spread, KPA)], []),
        note="means in MPa, median less lower quartile in kPa"),
    Claim("spectrum-minor", "At equal length of decay the form of the spectrum hardly matters.",
        "Sec. 5.3, par. 3, sentence 3", each(below(1.0, "%"), below(10.0, "%")),
        lambda d: ([_exponents(d, 0), _exponents(d, 1)], [])),
    Claim("wider-range", "A larger variance of the strength makes arrest (slightly) more likely.",
        "Sec. 5.2, par. 5, sentence 14", each(rising(), SLIGHT),
        lambda d: ([_from_usual(d), Series("at twice the range, with inertia", "",
                    shares(d, "wide_strength", (1,), inertia=True).rows)],
                   [shares(d, "wide_strength")])),
    Claim("cascade", "With a much larger range of strength small events would come first.",
        "Sec. 5.4, par. 4, sentences 5 and 6", above(0.5, "one in every other sample"),
        lambda d: ([one("arrested events a sample with inertia, four times the range",
                        events_a_sample(d, inertia=True))],
                   [one("without inertia", events_a_sample(d, inertia=False))])),
    Claim("small-events-interact", "Arrested small events could then interact.",
        "Sec. 5.4, par. 4, sentence 5", above(0.0), _triggered,
        note="without inertia, at four times the range: events follow events nearby"),
    Claim("required",
        "Non-uniform driving is required for arrested fronts.", "Abstract, sentence 11",
        RARE, _both("wide_strength", 3),
        note="judged by wide strength under uniform driving: fronts are arrested without it"),
    Claim("random-stress-drop",
        "A random driving force, by a random stress drop, can arrest fronts.",
        "Abstract, sentence 11; Sec. 5.2, par. 6, sentence 3", above(0.01),
        _both("random_residual", 4)),
    Claim("random-load", "Random load on a small scale does not cause arrest.",
        "Sec. 5.2, par. 7, sentence 3", below(0.05, "one sample in twenty"),
        _both("random_load", 5)),
]  # fmt: skip


def _from_usual(d: Data) -> Series:
    usual = arrested(d, RATIOS[1], "dynamic" if "dynamic" in d else "ruptures")
    moving = shares(d, "wide_strength", inertia=True)
    label = moving.label.partition(" (")[0]  # the paper's range has another number of ruptures
    return Series(label, "", [("the paper's range", usual), *moving.rows])


GROUPS = {
    "Slip patches and how they interact": PATCHES,
    "Run-away, arrest and what drives it": ARREST,
    "Size of the interface and of the scatter": SIZE,
    "What if": WHAT_IF,
}
