"""Texts of the page that contain results; all others are in `page.toml`."""

import numpy as np

from reproduction import rules, setting
from reproduction.claims import Data, rounded
from reproduction.modulus import compare
from reproduction.numbers_with_errors import lower_spread, mean, root_mean_square, share
from reproduction.setting import RATIOS, SIMULATED
from reproduction.statements_onset import dynamic_mean, offsets, rate_offsets, trend
from reproduction.statements_rupture import arrested, shares


def _at(rows) -> str:
    return ", ".join(rounded(number) for number in rows)


def _least(rows) -> float:
    return min(rows, key=lambda row: row[1].value)[0]


def in_short(d: Data) -> dict:
    """Return the numbers of the findings that the page begins with."""
    moments, exact = ([d.at(study, name, r) for r in RATIOS] for study, name in (
        ("moments", "bound"), ("exact", "first_instability")))  # fmt: skip
    offset, likely = dict(rate_offsets(d)), {each.key: each.likelihood for each in compare(d)}
    one, two = max(likely["a"], likely["b"]), max(likely["c"], likely["c'"])
    wide, spread = trend(d, mean, 1e-6), trend(d, lower_spread, 1e-3)
    found = {
        "means": [rounded(mean(d.stress(r)) * 1e-6) for r in RATIOS],
        "errors": [root_mean_square(d.excess(r)).value * 100 for r in RATIOS],
        "offset": offset["1 times"].value,
        "slow_offset": offset["0.1 times"].value,
        "rises": rules.rising()([[number for _, number in spread]]).value,
        "spreads": ", ".join(f"{n.value:.0f}" for _, n in spread),
        "ratios": ", ".join(f"{r:g}" for r, _ in spread),
        "trend": d.size.trend,
        "least": _least(wide),
        "likelier": f"{two / one:.2g} times" if one else "infinitely",
        "arrests": _at([arrested(d, r) * 100 for r in RATIOS]),
        "above": sum(
            int(np.sum(b >= e * (1 - 1e-9))) for b, e in zip(moments, exact, strict=True)
        ),
        "samples_in_all": len(RATIOS) * d.size.samples,
    }
    if "wide_strength" in d:
        still, moving = (d.what_if(f"wide_strength{form}", "arrested_events", -1) > 0
                         for form in ("", "-inertia"))  # fmt: skip
        found |= {"still": rounded(share(still) * 100), "moving": moving}
    return found


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
        "The mean falls from "
        + " to ".join(rounded(dynamic_mean(d, r) * 1e-6) for r in (SIMULATED[0], SIMULATED[-1]))
        + f" MPa by ruptures. Of the few ruptures the {worst[1]} at {worst[0]:g} is furthest from"
        f" that of all samples: {worst[-2]:+.1f} standard errors."
    )


def _bound(d: Data) -> str:
    parts = []
    for ratio in RATIOS:
        exact = d.at("exact", "first_instability", ratio)
        below = float((d.at("moments", "bound", ratio) < exact * (1 - 1e-9)).mean())
        other = float((d.excess(ratio) < 0).mean())
        parts.append(f"{below:.1%} and {other:.0%} at {ratio:g}")
    return (
        "The exact onset is above the bound of the grid and above the continuous criterion, which"
        f" does not depend on the grid, in {'; '.join(parts)} of samples."
    )


def _range(d: Data) -> str:
    wide, spread = trend(d, mean, 1 / setting.MEAN), trend(d, lower_spread, 1e-3)
    dip = min(spread[3:], key=lambda row: row[1].value)
    hump = max(spread[:5], key=lambda row: row[1].value)
    return (
        f"The mean is least near xi_0/h_n = {_least(wide):g}. The spread has a hump of"
        f" {rounded(hump[1])} kPa near {hump[0]:g} and a dip of {rounded(dip[1])} kPa near"
        f" {dip[0]:g}. {d.size.trend:,} samples a point."
    )


def _arrest(d: Data) -> str:
    rows = [(case, number) for name in ("wide_strength", "random_load", "random_residual")
            for case, number in shares(d, name, inertia=True).rows]  # fmt: skip
    parts = ", ".join(f"{case}: {rounded(number * 100)} %" for case, number in rows)
    few = "" if d.size.arrests >= 100 else (
        f" Only {d.size.arrests} ruptures each: 'python reproduction --full' takes 200."
    )  # fmt: skip
    return f"With inertia: {parts}. Inertia carries some events through, not all.{few}"


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
    return (
        f"{events.sizes['event']} arrested samples were run again with inertia;"
        f" {int((events['dynamic'] > 0).sum())} of them were arrested in the rupture, too."
    )


def _rates(d: Data) -> str:
    parts = ", ".join(f"{case} the usual rate {rounded(n)} %" for case, n in rate_offsets(d))
    return f"At {parts}: ruptures differ from equilibrium by the loading rate, not by inertia."


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
    14: _arrest,
}
"""What we find in each figure, with numbers; other findings stand in `page.toml`."""
