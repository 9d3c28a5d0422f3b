"""Texts of the page that contain results; all others are in `page.toml`."""

import numpy as np

from reproduction import setting
from reproduction.claims import Data, rounded
from reproduction.modulus import at, odds
from reproduction.numbers_with_errors import Number, lower_spread, mean, root_mean_square, share
from reproduction.rules import Verdict
from reproduction.setting import RATIOS, SIMULATED
from reproduction.statements_onset import dynamic_mean, least, offsets, rate_offsets, trend
from reproduction.statements_rupture import arrested, shares, with_inertia

ABOVE = 1e-9
"""Relative: what is nearer than the tolerance of the solver is equal."""


def _at(rows) -> str:
    return ", ".join(rounded(number) for number in rows)


def _error(values) -> Number:
    return root_mean_square(values) * 100.0


def in_short(d: Data, found: dict) -> list[str]:
    """Return the findings that the page begins with; `found` has those of all claims by name."""
    rate, times = dict(rate_offsets(d)), odds(d)
    wide, spread = trend(d, mean, 1e-6), dict(trend(d, lower_spread, 1e-3))
    own, tiny = d["vanishing"]["stress"], [lower_spread(d.stress(r)) * 1e-3 for r in RATIOS]
    place, smallest = least(wide)
    mixed = [_error(at(d, "c", "excess", r)) for r in (0.25, 2.0)]
    depends = sum(each.verdict is Verdict.TEXT for each in found.values())
    above, samples = bound_holds(d)
    below = local_below(d, 2.0)
    more = ""
    if "wide_strength" in d:
        rows = [shares(d, "wide_strength", (3,), inertia=moving).rows[0][1] * 100.0
                for moving in (False, True)]  # fmt: skip
        more = (
            f"; at four times the range of strength {rounded(rows[0])} and {rounded(rows[1])} %"
        )
    return [
        f"The mean critical stress falls from {rounded(mean(d.stress(0.25)) * 1e-6)} MPa at"
        f" xi_0/h_n = 0.25 to {rounded(mean(d.stress(2.0)) * 1e-6)} MPa at 2 (local criterion).",
        f"It predicts the exact onset to {_at([_error(d.excess(r)) for r in (0.25, 2.0)])} %"
        f" at 0.25 and 2 (root mean square) with one modulus, to {_at(mixed)} % with two.",
        f"It leaves out interaction: exact equilibrium is {rounded(rate['1 times'])} % below the"
        f" ruptures, {rounded(rate['0.1 times'])} % at a tenth of their loading rate.",
        "That shorter correlation makes the stress vary less"
        f" {verb(found['variability'].verdict)} from 0.25 to 2: {rounded(tiny[0])} to"
        f" {rounded(tiny[-1])} kPa; {rounded(lower_spread(own[0].values) * 1e-3)} at 1/64,"
        f" {rounded(spread[30.0])} at 30 (median less lower quartile).",
        f"With the length fixed the mean is least near xi_0/h_n = {place:g},"
        f" {rounded(smallest)} MPa, and {rounded(wide[-1][1])} MPa at {wide[-1][0]:g}.",
        f"The text says plane stress and prints a modulus of plane strain: what it reports is"
        f" {times[0]:.2g} times as likely ({times[1]:.2g} to {times[2]:.2g}) with two moduli as"
        f" with one. {depends} findings depend on it.",
        f"Arrested events: in {_at([arrested(d, r) * 100 for r in RATIOS])} % of samples without"
        f" inertia, {_at([with_inertia(d, r) * 100 for r in RATIOS])} % with it, at 0.25, 0.5, 1, 2"
        f"{more}.",
        f"The grid's eigenvector bounds the exact onset in {above:,} of {samples:,} samples. The"
        f" local criterion lies below it in {rounded(below[0] * 100.0)} % at 2, by"
        f" {rounded(below[1])} % on average and {rounded(below[2])} % at most.",
    ]


def verb(verdict: Verdict) -> str:
    """Return a verdict as the verb of a sentence."""
    return f"is {verdict.value}" if verdict in (Verdict.OPEN, Verdict.TEXT) else verdict.value


def bound_holds(d: Data) -> tuple[int, int]:
    """Return how often the bound of the grid is above the exact onset, of how many samples."""
    pairs = [
        (d.at("moments", "bound", r), d.at("exact", "first_instability", r)) for r in RATIOS
    ]
    return sum(int(np.sum(b >= e * (1 - ABOVE))) for b, e in pairs), sum(
        b.size for b, _ in pairs
    )


def local_below(d: Data, ratio: float) -> tuple[Number, Number, Number]:
    """Return the share of samples with the local criterion below the exact onset, and by how much
    on average and at most, %."""
    depth = -100.0 * d.excess(ratio)
    found = depth > 100.0 * ABOVE
    if found.sum() < 2:
        return share(found), Number(0.0), Number(0.0)
    return share(found), mean(depth[found]), Number(float(depth.max()))


def _figure_4(d: Data) -> str:
    def misplaced(study: str, length: float) -> int:
        own, others = ([d.at(name, "critical_position", r) for r in SIMULATED]
                       for name in ("ruptures", study))  # fmt: skip
        pairs = zip(own, others, strict=True)
        return sum(
            int((setting.distance(a, b[: a.size]) > 0.5 * length).sum()) for a, b in pairs
        )

    count = len(SIMULATED) * d.size.ruptures
    errors = [mean(offsets(d, r, "local")) * 100 for r in SIMULATED]
    return (
        f"The theory exceeds the ruptures by {_at(errors)} % on average at xi_0/h_n = 0.25, 0.5 and"
        f" 2. It misplaces {misplaced('local', setting.H)} of {count} onsets;"
        f" {misplaced('printed', setting.PRINTED_H)} with the printed modulus."
    )


def _figure_6(d: Data) -> str:
    rows = few_and_many(d)
    worst = max(rows, key=lambda row: abs(row[-2]))
    return (
        "The mean of exact equilibrium, shifted by the mean difference of the ruptures from it,"
        " falls from "
        + " to ".join(rounded(dynamic_mean(d, r) * 1e-6) for r in (SIMULATED[0], SIMULATED[-1]))
        + f" MPa. Of the few ruptures the {worst[1]} at {worst[0]:g} is furthest from"
        f" that of all samples: {worst[-2]:+.1f} standard errors."
    )


def _bound(d: Data) -> str:
    parts = []
    for ratio in RATIOS:
        often, much, most = local_below(d, ratio)
        parts.append(f"{rounded(often * 100.0)} % at {ratio:g} (by {rounded(much)} % on average,"
                     f" {rounded(most)} % at most)")  # fmt: skip
    above, samples = bound_holds(d)
    return (
        f"The bound of the grid is above the exact onset in {above:,} of {samples:,} samples. The"
        " continuous criterion, which does not depend on the grid, is below it in"
        f" {', '.join(parts)} of samples."
    )


def _range(d: Data) -> str:
    wide, spread = trend(d, mean, 1 / setting.MEAN), dict(trend(d, lower_spread, 1e-3))
    parts = ", ".join(f"{rounded(spread[r])} at {r:g}" for r in (0.0625, 0.25, 2.0, 30.0))
    return (
        f"The mean is least near xi_0/h_n = {least(wide)[0]:g}. The spread (kPa) rises, falls in"
        f" the paper's range, and rises again: {parts}. {d.size.trend:,} samples a point."
    )


def _arrest(d: Data) -> str:
    parts = []
    for name in ("wide_strength", "random_load", "random_residual"):
        rows = shares(d, name, inertia=True).rows
        count = d[f"{name}-inertia"].sizes["sample"]
        parts += [f"{case}: {rounded(number * 100)} % of {count}" for case, number in rows]
    return f"With inertia: {', '.join(parts)}. Inertia carries some events through, not all."


def few_and_many(d: Data) -> list[tuple]:
    """Return, for each mean and deviation, that of the ruptures, of all samples, and how far
    they are apart in standard errors of so few, with the chance of it.

    The error of the few is estimated from all samples by resampling: their own is too small just
    when their scatter is.
    """
    generator = np.random.default_rng(0)
    rows = []
    for ratio in SIMULATED:
        few = d.stress(ratio, "ruptures") * 1e-6
        shift = float(np.mean(offsets(d, ratio, "exact")))
        many = d.stress(ratio, "exact") * 1e-6 * (1.0 - shift)
        drawn = generator.choice(many, (4000, few.size))
        for name, function in (("mean", np.mean), ("standard deviation", np.std)):
            found, null = float(function(few)), function(drawn, axis=1)
            z = (found - null.mean()) / null.std()
            below = float(np.mean(null <= found))
            chance = min(2.0 * min(below, 1.0 - below) + 1.0 / null.size, 1.0)
            rows.append((ratio, name, found, float(function(many)), z, chance))
    return rows


def _patch(d: Data) -> str:
    length = float(d["representative"]["patch_length"]) / setting.H
    return (
        f"The same. The patch is {length:.2f} h_n long at the peak of the load. Its front soon runs"
        " faster than shear waves: compare with the slopes of c_s and c_d."
    )


def _mechanism(d: Data) -> str:
    study = d["mechanism"]
    return (
        "A patch about to become unstable raises the stress h_n/4 beside it by"
        f" {float(study['beside']) * 100:.1f} %. Two equal dips 1.25 h_n apart lower the onset by"
        f" {float(study['lowering'][0]) * 100:.2f} %."
    )


def _arrested_again(d: Data) -> str:
    events = d["arrest"]
    again = int((events["dynamic"] > 0).sum())
    total = sum(int((d.at("exact", "arrested_events", r) > 0).sum()) for r in RATIOS)
    return (
        f"{events.sizes['event']} of the {total} samples with an arrested event, the first ten of"
        f" each correlation length, were run again with inertia; {again} of them were arrested in"
        " the rupture, too."
    )


def _rates(d: Data) -> str:
    parts = ", ".join(f"{case} the usual rate {rounded(n)} %" for case, n in rate_offsets(d))
    return f"At {parts}: the difference is an effect of the loading rate, and vanishes with it."


def _driving(d: Data) -> str:
    study, parts = d["driving"], []
    for case in ("edge", "gradient", "uniform"):
        length = study["length"].sel(case=case).values / setting.H
        count, far = int(np.isfinite(length).sum()), int((length > 3.0).sum())
        parts.append(f"{case}: {count}, {far} of them longer than 3 h_n")
    samples = study.sizes["sample"]
    return (
        f"Arrested events of {samples} samples of each load, all shown: {'; '.join(parts)}. An edge"
        " is shown to be sufficient for long fronts; that it is necessary is not (Figure 14)."
    )


def _ends(d: Data) -> str:
    rows = d["free_end"]["change"].values[: len(RATIOS)] * 100.0
    return (
        "A longer interface and more pressure make the critical stress vary less. Free ends change"
        f" it by {_at([mean(row) for row in rows])} % at 0.25, 0.5, 1 and 2, in mode III."
    )


OURS = {
    3: _patch,
    4: _figure_4,
    6: _figure_6,
    7: lambda d: (
        f"The same, with the factor {float(d['theory']['infinite'][0] / 0.02):.3f} for"
        " short correlation, which the paper leaves open."
    ),
    8: _bound,
    9: _range,
    10: _rates,
    11: _mechanism,
    12: _arrested_again,
    13: _driving,
    14: _arrest,
    15: _ends,
}
"""What we find in each figure, with numbers; other findings stand in `page.toml`."""
