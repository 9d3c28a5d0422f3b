"""Numbers and words that the texts of the page name; the texts are templates in `page.toml`.

Every function below takes the studies first. A template calls it by its name without them, and a
text whose studies are not computed in this run is left out.
"""

import functools

import numpy as np

from reproduction import setting
from reproduction import statements_onset as onset
from reproduction import statements_rupture as rupture
from reproduction.claims import Data, LeftOut, judge, rounded, short
from reproduction.modulus import odds
from reproduction.numbers_with_errors import Number, lower_spread, mean, root_mean_square, share
from reproduction.rules import Verdict
from reproduction.setting import FIRST, LAST, RATIOS, SIMULATED
from reproduction.statements_onset import PER_CENT

ABOVE = 1e-9
"""Relative difference of two onsets that the tolerance of the solver cannot tell from zero."""


def over(function, ratios=RATIOS) -> list[Number]:
    """Return function(ratio) at several xi_0/h_n."""
    return [function(ratio) for ratio in ratios]


def named(verdict: Verdict) -> str:
    """Return a verdict as the verb of a sentence."""
    return f"is {verdict.value}" if verdict in (Verdict.OPEN, Verdict.TEXT) else verdict.value


def verdict(d: Data, name: str) -> str:
    """Return the verdict on a statement as the verb of a sentence."""
    claims = [claim for rows in (onset.GROUPS | rupture.GROUPS).values() for claim in rows]
    finding = judge(next(claim for claim in claims if claim.name == name), d)
    if finding is None:
        raise LeftOut(name)
    return named(finding.verdict)


def moves(d: Data, function, first=FIRST, last=LAST) -> str:
    """Return how a quantity changes from the first to the last correlation length, in words."""
    start, end = function(first), function(last)
    change = end - start
    word = "falls" if change.value < -2.0 * change.error else "rises"
    word = word if abs(change.value) > 2.0 * change.error else "hardly changes"
    return f"{word} from {short(start)} to {short(end)}"


def stress(d: Data, ratio: float) -> Number:
    """Mean tau_cr by the local criterion, MPa."""
    return mean(d.stress(ratio)) * 1e-6


def spread(d: Data, ratio: float) -> Number:
    """Median less lower quartile of tau_cr, kPa."""
    return lower_spread(d.stress(ratio)) * 1e-3


def error(d: Data, ratio: float) -> Number:
    """Error of the local criterion against exact equilibrium, root mean square, %."""
    return root_mean_square(d.excess(ratio)) * PER_CENT


def above_ruptures(d: Data, study: str, ratio: float) -> Number:
    """A static onset above the rupture of the same sample, mean, %."""
    return mean(onset.offsets(d, ratio, study)) * PER_CENT


def misplaced(d: Data, study: str) -> int:
    """Ruptures whose onset a static method places more than h_n/2 elsewhere."""
    count = 0
    for ratio in SIMULATED:
        place, predicted = (
            d.at(name, "critical_position", ratio) for name in ("ruptures", study)
        )
        length = setting.PRINTED_H if study == "printed" else setting.H
        count += int((setting.distance(place, predicted[: place.size]) > 0.5 * length).sum())
    return count


def likelier(d: Data, visible: float = 1.0) -> tuple[float, float, float]:
    """How much more likely two moduli are than one, with a 95 % interval."""
    return odds(d, visible=visible)


def most_arrested(d: Data) -> tuple[float, Number]:
    """The xi_0/h_n with the most arrested samples without inertia, and their share, %."""
    shares = {ratio: rupture.arrested(d, ratio) * PER_CENT for ratio in RATIOS}
    return max(shares.items(), key=lambda item: item[1].value)


def front_speed(d: Data) -> Number:
    """Median speed of the fronts of all ruptures over the shear wave speed, mean."""
    speeds = [d.at("ruptures", "median_rupture_speed", ratio) for ratio in SIMULATED]
    return mean(np.concatenate(speeds) / setting.PROBLEM.solid.shear_wave_speed)


def bounded(d: Data) -> tuple[int, int]:
    """Samples whose exact onset is below the bound of the grid, and all samples."""
    bounds = np.array([onset.bound_above(d, ratio) for ratio in RATIOS])
    return int(np.sum(bounds >= -ABOVE)), bounds.size


def local_below(d: Data, ratio: float) -> tuple[Number, Number]:
    """Share of samples with the local criterion below the exact onset, and the largest depth, %."""
    depth = -PER_CENT * d.excess(ratio)
    return share(depth > PER_CENT * ABOVE) * PER_CENT, Number(max(float(depth.max()), 0.0))


def smoothing(d: Data) -> list[float]:
    """Least and largest width of the kernels of the densities, kPa."""
    widths = [1e-3 * onset.stress_density(d, ratio).bandwidth for ratio in RATIOS]
    return [min(widths), max(widths)]


def shifted(d: Data, ratio: float) -> Number:
    """Mean of exact equilibrium, shifted by the mean difference of the ruptures from it, MPa."""
    return onset.dynamic_mean(d, ratio) * 1e-6


def short_factor(d: Data) -> float:
    """Factor between the variance ratio and xi_0/h_n for short correlation."""
    return float(d["theory"]["infinite"][0] / d["theory"]["ratio"][0])


def patch(d: Data) -> float:
    """Length of the critical patch of the shown rupture at the peak of the load, over h_n."""
    return float(d["representative"]["patch_length"]) / setting.H


def least(d: Data) -> tuple[float, Number]:
    """The xi_0/h_n of the least mean tau_cr over the wide range, and this mean, MPa."""
    return min(onset.trend(d, mean, 1e-6), key=lambda row: row[1].value)


def far_spread(d: Data, ratio: float) -> Number:
    """Median less lower quartile of tau_cr over the wide range, kPa."""
    return dict(onset.trend(d, lower_spread, 1e-3))[ratio]


def rate(d: Data) -> dict[str, Number]:
    """How far ruptures lie above equilibrium at each loading rate, %."""
    return dict(onset.rate_offsets(d))


def changes(d: Data, *cases: str) -> str:
    """Largest change of tau_cr of a rupture with another grid or step, %."""
    return f"{max(onset.convergence(d, case) for case in cases):.2g}"


def patches(d: Data) -> list[Number]:
    """Slipping patches at .999 of the onset, at the onset, and at the onset of all samples."""
    grown = d.at("growth", "patches", FIRST)[:, -1]
    return [mean(grown), *(number for _, number in rupture.patches_at_onset(d).rows)]


def rerun(d: Data) -> tuple[int, int]:
    """Arrested samples that were run again with inertia, and those arrested then, too."""
    return d["arrest"].sizes["event"], int((d["arrest"]["dynamic"].values > 0).sum())


def driven(d: Data, case: str) -> np.ndarray:
    """Lengths of arrested fronts under a non-uniform load, over h_n."""
    return d["driving"]["length"].sel(case=case).values / setting.H


def counted(d: Data, name: str) -> list[tuple[str, str]]:
    """Ruptures with an arrested event at the points of a what-if, in words."""
    size = d[f"{name}-inertia"].sizes["sample"]
    rows = rupture.shares(d, name, inertia=True).rows
    return [(case, f"{number.value * size:.0f} of {size}") for case, number in rows]


def over_mean(d: Data, skew: int) -> list[Number]:
    """Mean of tau_cr over that of the paper's strength, or of its mirror image."""
    strength = setting.LOW + setting.HIGH - setting.MEAN if skew else setting.MEAN
    return over(lambda ratio: mean(rupture.skewed(d, skew, ratio)) / strength)


def by_ends(d: Data) -> list[Number]:
    """Mean change of tau_cr by free ends, %."""
    return over(lambda ratio: mean(rupture.ends_change(d, ratio)))


FUNCTIONS = (
    above_ruptures, bounded, by_ends, changes, counted, driven, error, far_spread, front_speed,
    least, likelier, local_below, misplaced, moves, most_arrested, over_mean, patch, patches, rate,
    rerun, shifted, short_factor, smoothing, spread, stress, verdict,
)  # fmt: skip


def names(d: Data) -> dict:
    """Return all that a text may name."""
    known = {function.__name__: functools.partial(function, d) for function in FUNCTIONS}
    return known | {
        "d": d,
        "setting": setting,
        "first": FIRST,
        "second": setting.SECOND,
        "last": LAST,
        "listed": lambda rows, form=short: ", ".join(form(number) for number in rows),
        "above_ruptures_of": lambda study: functools.partial(above_ruptures, d, study),
        "at_all": lambda function, ratios=RATIOS: over(function, ratios),
        "ratios": ", ".join(f"{ratio:g}" for ratio in RATIOS),
        "simulated": SIMULATED,
        "number": rounded,
    }


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
            value, resampled = float(function(few)), function(drawn, axis=1)
            z = (value - resampled.mean()) / resampled.std()
            below = float(np.mean(resampled <= value))
            chance = min(2.0 * min(below, 1.0 - below) + 1.0 / resampled.size, 1.0)
            rows.append((ratio, name, value, float(function(many)), z, chance))
    return rows
