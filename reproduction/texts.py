"""Results that the texts of the page hold; the texts are templates in `page.toml`."""

import numpy as np

from reproduction import setting
from reproduction import statements_onset as onset
from reproduction import statements_rupture as rupture
from reproduction.claims import Data, rounded
from reproduction.modulus import at, odds
from reproduction.numbers_with_errors import Number, lower_spread, mean, root_mean_square, share
from reproduction.rules import Verdict
from reproduction.setting import RATIOS, SIMULATED

ABOVE = 1e-9  # relative; what is nearer than the tolerance of the solver is equal
PER_CENT = 100.0


def names(d: Data, found: dict) -> dict:
    """Return functions and numbers that a text may name; `found` has all findings by name."""
    wide = onset.trend(d, mean, 1e-6)

    def over(function, ratios=RATIOS) -> list[Number]:
        return [function(ratio) for ratio in ratios]

    def error(values) -> Number:
        return root_mean_square(values) * PER_CENT

    def shared(name: str, inertia: bool = True) -> list[tuple[str, Number]]:
        return rupture.shares(d, name, inertia=inertia).rows

    def counted(name: str) -> list[tuple[str, str]]:
        size = d[f"{name}-inertia"].sizes["sample"]
        return [(case, f"{n.value * size:.0f} of {size}") for case, n in shared(name)]

    def over_mean(skew: int) -> list[Number]:
        """Return the mean of tau_cr over that of the paper's strength, or of its mirror image."""
        own = setting.LOW + setting.HIGH - setting.MEAN if skew else setting.MEAN
        return over(lambda r: mean(rupture.skewed(d, skew, r)) / own)

    widths = [1e-3 * onset.stress_density(d, ratio).bandwidth for ratio in RATIOS]
    edge = d["driving"].sel(case="edge")
    bounds = np.array([onset.bound_above(d, ratio) for ratio in RATIOS])
    grown = d.at("growth", "patches", 0.25)[:, -1]
    return {
        "d": d,
        "h": setting.H,
        "numbers": lambda rows: ", ".join(rounded(number) for number in rows),
        "stress": lambda ratio: mean(d.stress(ratio)) * 1e-6,
        "spread": lambda ratio: lower_spread(d.stress(ratio)) * 1e-3,
        "far_spread": dict(onset.trend(d, lower_spread, 1e-3)),
        "tiny_spread": lower_spread(d["vanishing"]["stress"][0].values) * 1e-3,
        "errors": over(lambda r: error(d.excess(r)), (0.25, 2.0)),
        "mixed": over(lambda r: error(at(d, "c", "excess", r)), (0.25, 2.0)),
        "rate": dict(onset.rate_offsets(d)),
        "verb": verb(found["variability"].verdict),
        "least": min(wide, key=lambda row: row[1].value),
        "last": wide[-1],
        "odds": odds(d),
        "otherwise": [odds(d, visible=seen)[0] for seen in (0.5, 2.0)],
        "depends": sum(len({*each.readings.values()}) > 1 for each in found.values()),
        "still": over(lambda r: rupture.arrested(d, r) * PER_CENT),
        "moving": over(lambda r: rupture.with_inertia(d, r) * PER_CENT),
        "shared": shared,
        "counted": counted,
        "over_mean": over_mean,
        "changes": lambda *cases: f"{max(onset.convergence(d, c) for c in cases):.2g}",
        "patches": [mean(grown), *(number for _, number in rupture.patches_at_onset(d).rows)],
        "far": over(lambda r: share(d.excess(r) > 0.02) * PER_CENT, RATIOS[:2]),
        "furthest_above": [PER_CENT * d.excess(r).max() for r in RATIOS[:2]],
        "smoothing": [f(widths) for f in (min, max)],
        "endless": int((np.isinf(edge["griffith"]) & np.isfinite(edge["length"])).sum()),
        "bound": [int(np.sum(bounds >= -ABOVE)), bounds.size],
        "below": dict(zip(RATIOS, over(lambda r: local_below(d, r)), strict=True)),
        "over_ruptures": over(lambda r: mean(onset.offsets(d, r, "local")) * 100.0, SIMULATED),
        "misplaced": lambda study: sum(over(lambda r: _misplaced(d, study, r), SIMULATED)),
        "shifted": over(lambda r: onset.dynamic_mean(d, r) * 1e-6, SIMULATED),
        "arrested": sum(over(lambda r: int((d.at("exact", "arrested_events", r) > 0).sum()))),
        "driven": lambda case: d["driving"]["length"].sel(case=case).values / setting.H,
        "by_ends": over(lambda r: mean(rupture.ends_change(d, r))),
    }


def verb(verdict: Verdict) -> str:
    """Return a verdict as the verb of a sentence."""
    return f"is {verdict.value}" if verdict in (Verdict.OPEN, Verdict.TEXT) else verdict.value


def local_below(d: Data, ratio: float) -> tuple[Number, Number, Number]:
    """Return the share of samples with the local criterion below the exact onset, and by how much
    on average and at most, all in %."""
    depth = -PER_CENT * d.excess(ratio)
    found = depth > PER_CENT * ABOVE
    often = share(found) * PER_CENT
    if found.sum() < 2:
        return often, Number(0.0), Number(0.0)
    return often, mean(depth[found]), Number(float(depth.max()))


def _misplaced(d: Data, study: str, ratio: float) -> int:
    own, other = (d.at(name, "critical_position", ratio) for name in ("ruptures", study))
    length = setting.PRINTED_H if study == "printed" else setting.H
    return int((setting.distance(own, other[: own.size]) > 0.5 * length).sum())


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
        shift = float(np.mean(onset.offsets(d, ratio, "exact")))
        many = d.stress(ratio, "exact") * 1e-6 * (1.0 - shift)
        drawn = generator.choice(many, (4000, few.size))
        for name, function in (("mean", np.mean), ("standard deviation", np.std)):
            found, null = float(function(few)), function(drawn, axis=1)
            z = (found - null.mean()) / null.std()
            below = float(np.mean(null <= found))
            chance = min(2.0 * min(below, 1.0 - below) + 1.0 / null.size, 1.0)
            rows.append((ratio, name, found, float(function(many)), z, chance))
    return rows
