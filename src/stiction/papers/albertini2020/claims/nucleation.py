"""Claims about the nucleation stress tau_n: mean, variance, shape, limits."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All
from stiction.papers.albertini2020.claims.measures import at_each, labelled, one
from stiction.papers.albertini2020.claims.rules import Above, Below, Falling, Rising, near
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import nucleation_moments, variance_ratio
from stiction.statistics.estimates import Estimate, mean
from stiction.statistics.moments import nucleation_statistics


@claim(
    where="Sec. 4.2, Eq. B.2",
    says="The mean nucleation stress is the mean strength, whatever the correlation length.",
    needs=("monte_carlo", "theory"),
    rule=near(1.0, limits.ONE_PER_CENT),
)
def nucleation_mean(data: Data) -> Measured:
    """Monte Carlo mean over <tau_p>."""
    return Measured(at_each(data, lambda ratio: nucleation_moments(data, ratio)[0]))


@claim(
    where="Sec. 4.2, Eq. B.3",
    says="The variance of tau_n follows from a double integral of correlation and eigenfunction.",
    needs=("monte_carlo", "theory"),
    rule=near(1.0, limits.Limit("follows from", 0.03, "", "three errors of 10,000 samples")),
)
def nucleation_variance(data: Data) -> Measured:
    """Monte Carlo variance ratio over the exact one, with the correlation of tau_p itself."""
    exact = data["theory"]["variance_ratio"]

    def quotient(ratio: float) -> Estimate:
        known = float(exact.sel(correlation_ratio=ratio))
        return variance_ratio(data, ratio).scaled(1.0 / known)

    return Measured(at_each(data, quotient), comment="Monte Carlo over exact")


@claim(
    where="Sec. 4.2, Eq. B.5, Fig. 7d",
    says="For short correlation the variance of tau_n is proportional to xi_0/h_n.",
    needs=("theory",),
    rule=near(1.0, limits.SLOPE),
)
def linear_variance(data: Data) -> Measured:
    """Logarithmic slope at xi_0 = h_n/50, and how far the line carries (to 10 %)."""
    theory = data["theory"]
    ratio, value = theory["ratio"].values, theory["variance_ratio_infinite"].values
    slope = float(np.log(value[1] / value[0]) / np.log(ratio[1] / ratio[0]))
    line = theory.attrs["short_slope"] * ratio
    off = np.flatnonzero(np.abs(value / line - 1.0) > 0.1)
    reach = float(ratio[off[0]]) if off.size else float(ratio[-1])
    return Measured(
        one("logarithmic slope", slope),
        (*one("factor", theory.attrs["short_slope"]), *one("10 % off at xi_0/h_n", reach)),
    )


@claim(
    where="Sec. 4.2, Eq. B.4",
    says="For long correlation the variance of tau_n becomes that of tau_p.",
    needs=("theory",),
    rule=near(1.0, limits.AT_BOUND),
)
def long_variance(data: Data) -> Measured:
    """Variance ratio at xi_0 = 20 h_n on an infinite interface; limit on this one."""
    own = float(data["theory"].attrs["long_ratio_fixed_length"])
    return Measured(
        one("xi_0/h_n = 20", data["theory"]["variance_ratio_infinite"].values[-1]),
        one("limit at fixed L", own),
        comment="on an interface of fixed length without mean mode it ends a little lower",
    )


@claim(
    where="Sec. 4.2",
    says="For long correlation the moving average becomes the identity: tau_n is tau_p.",
    needs=("theory",),
    rule=All(Falling(), Below(limits.Limit("becomes", 0.05, "", "five per cent of the spread"))),
)
def identity_limit(data: Data) -> Measured:
    """Root of the variance of what averaging removes, over that of tau_p, ever shorter windows."""
    setting = data.setting
    ratios = [data.ratios[-1] * factor for factor in (1.0, 2.0, 4.0, 8.0)]
    # On an infinite line only xi_0/h_n counts, whichever of the two changes.
    kept = [
        nucleation_statistics(setting.problem, setting.field(r), infinite=True).variance_ratio
        for r in ratios
    ]
    series = labelled(ratios, [Estimate(float(np.sqrt(1.0 - each))) for each in kept])
    return Measured(
        (series[:-1], series[-1:]),
        comment="root of 1 - Var[tau_n]/Var[tau_p]: falls to zero like h_n/xi_0",
    )


@claim(
    where="Sec. 4.2",
    says="For vanishing correlation length tau_n concentrates on <tau_p>.",
    needs=("theory",),
    rule=All(Falling(), Below(limits.NARROW)),
)
def short_limit(data: Data) -> Measured:
    """Standard deviation of tau_n over that of tau_p, down to a fiftieth of h_n."""
    value = np.sqrt(data["theory"]["variance_ratio_infinite"].values)[:20:5][::-1]
    ratio = data["theory"]["ratio"].values[:20:5][::-1]
    series = labelled([round(float(r), 3) for r in ratio], [Estimate(float(v)) for v in value])
    return Measured((series, series[-1:]), comment="standard deviation over that of tau_p")


@claim(
    where="Sec. 4.2, Fig. 5e",
    says="tau_n is skewed like tau_p; the longer the correlation the more.",
    needs=("monte_carlo",),
    rule=All(Rising(), Above(0.0), Below(0.0)),
)
def nucleation_skewness(data: Data) -> Measured:
    """Skewness of tau_n, its sign, and what it lacks to that of tau_p."""
    own = float(np.asarray(data.setting.marginal.distribution.stats(moments="s")))
    sign = float(np.sign(own)) or 1.0
    series = at_each(data, lambda ratio: nucleation_moments(data, ratio)[2].scaled(sign))
    last = Quantity("longest, less that of tau_p", series[-1].estimate - abs(own))
    return Measured((series, series[:1], (last,)), one("tau_p", own))


@claim(
    where="Sec. 4.2, Fig. 5e",
    says="At the shortest correlation length tau_n is nearly Gaussian.",
    needs=("monte_carlo",),
    rule=Below(limits.GAUSSIAN),
)
def nearly_gaussian(data: Data) -> Measured:
    """Largest distance of the distribution functions; for comparison the longest."""

    def distance(ratio: float) -> float:
        at = data.at(ratio)
        counts = at["nucleation_counts"].values.astype(float)
        edges = np.linspace(
            float(at["nucleation_low"]), float(at["nucleation_high"]), counts.size + 1
        )
        share = np.cumsum(counts) / counts.sum()
        centre = 0.5 * (edges[1:] + edges[:-1])
        m = np.sum(counts * centre) / counts.sum()
        s = np.sqrt(np.sum(counts * (centre - m) ** 2) / counts.sum())
        return float(np.abs(share - ndtr((edges[1:] - m) / s)).max())

    # A distance of k in distribution functions needs about 1/k^2 independent values to be seen.
    error = 0.5 / np.sqrt(data.samples)
    first, last = data.ratios[0], data.ratios[-1]
    return Measured(
        one(f"distance at xi_0/h_n = {first:g}", distance(first), error=error),
        (
            *one(f"at {last:g}", distance(last), error=error),
            Quantity("skewness at the shortest", nucleation_moments(data, first)[2]),
        ),
        comment="largest distance between the distribution functions of tau_n and a normal one",
    )


@claim(
    where="Sec. 4.2, Fig. 5d",
    says="A longer correlation length makes minima of tau_n lower and maxima higher.",
    needs=("monte_carlo",),
    rule=All(Falling(), Rising()),
)
def nucleation_extremes(data: Data) -> Measured:
    """Mean over samples of the smallest and largest tau_n, over <tau_p>."""
    unit = 1.0 / data.setting.mean

    def of(key: str) -> tuple[Quantity, ...]:
        label = "min" if key == "critical_stress" else "max"
        return at_each(data, lambda r: mean(data.at(r)[key].values).scaled(unit), label=label)

    return Measured((of("critical_stress"), of("largest_nucleation_stress")))


@claim(
    where="Sec. 4.2, Fig. 5c",
    says="A shorter correlation length brings the weakest point closer to the lower bound.",
    needs=("monte_carlo",),
    rule=Rising(),
)
def weakest_point(data: Data) -> Measured:
    """Mean of min tau_p above the lower bound, over <tau_p>."""
    low, unit = data.setting.bounds[0], 1.0 / data.setting.mean
    reference = low if np.isfinite(low) else 0.0
    return Measured(
        at_each(
            data, lambda r: (mean(data.at(r)["weakest_strength"].values) - reference).scaled(unit)
        ),
        comment="mean of min tau_p above its bound, over <tau_p>",
    )
