"""Claims of the discussion: what if the strength, its spectrum or the load were different."""

from __future__ import annotations

import numpy as np

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, Softly
from stiction.papers.albertini2020.claims.measures import labelled, one, pairs
from stiction.papers.albertini2020.claims.rules import Above, Below, Falling, Rising, Verdict
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import scatter
from stiction.papers.albertini2020.studies.summary import estimates
from stiction.statistics.estimates import Estimate, mean, share


def _quotient(above: Estimate, below: Estimate) -> Estimate:
    value = above.value / below.value
    spread = np.hypot(above.error / above.value, below.error / below.value)
    return Estimate(value, value * float(spread))


@claim(
    where="Sec. 5.3",
    says="Strength skewed to high values would make the critical stress vary more.",
    needs=("skewness", "monte_carlo"),
    rule=Above(1.0),
)
def mirrored_variability(data: Data) -> Measured:
    """Median less lower quartile with the mirrored distribution over that with the setting's."""
    other = pairs(data["skewness"].sel(mirrored=1), "lower_spread")
    own = [scatter(data, ratio)["lower"] for ratio in data.ratios]
    return Measured(
        labelled(data.ratios, [_quotient(*both) for both in zip(other, own, strict=True)]),
        comment="median less lower quartile, mirrored over the paper's",
    )


@claim(
    where="Sec. 5.3",
    says="With the other skewness, too, a shorter correlation length means a higher critical"
    " stress that varies less.",
    needs=("skewness",),
    rule=All(Falling(), Rising()),
)
def mirrored_trend(data: Data) -> Measured:
    """Means, and median less lower quartile, of the mirrored distribution."""
    study = data["skewness"].sel(mirrored=1)
    means = [each.scaled(1e-6) for each in estimates(study, "mean")]
    spreads = [each.scaled(1e-3) for each in pairs(study, "lower_spread")]
    return Measured(
        (
            labelled(data.ratios, means, "MPa"),
            labelled(data.ratios, spreads, "kPa", "median less lower quartile"),
        )
    )


@claim(
    where="Sec. 5.3",
    says="At equal length of decay to 1/e the form of the spectrum hardly matters to tau_cr.",
    needs=("spectrum",),
    rule=All(Below(limits.ACCURATE_MEAN), Below(limits.ACCURATE_SPREAD)),
)
def spectrum_minor(data: Data) -> Measured:
    """Largest change of mean and standard deviation among the exponents."""
    study = data["spectrum"]

    def changes(name: str, label: str) -> tuple[Quantity, ...]:
        found = []
        for exponent in study["exponent"].values:
            if exponent == data.setting.exponent:
                continue
            other = study.sel(exponent=exponent)
            change = 100.0 * np.abs(other[f"{name}_change"].values)
            at = int(change.argmax())
            error = 100.0 * float(other[f"{name}_change_error"].values[at])
            found.append(
                Quantity(f"{label}, exponent {exponent:g}", Estimate(float(change[at]), error), "%")
            )
        return tuple(found)

    return Measured(
        (changes("mean", "mean"), changes("deviation", "st. dev.")),
        comment="largest change over the correlation lengths, on the same draws",
    )


def _share(data: Data, case: str) -> Quantity:
    return Quantity(case, share(data["disorder"]["arrested_events"].sel(case=case).values > 0))


@claim(
    where="Sec. 5.2",
    says="A larger variance of the strength makes arrest (slightly) more likely.",
    needs=("disorder",),
    rule=All(Rising(), Softly(Below(limits.SLIGHT))),
)
def wider_range(data: Data) -> Measured:
    """Share of samples with an arrested event as the range widens, by equilibrium."""
    cases = [_share(data, c) for c in ("as it is", "twice the range", "four times the range")]
    dynamic = data["disorder"]["dynamic_arrests"]
    return Measured(
        (cases, cases),
        tuple(
            Quantity(f"{case}, with inertia", share(dynamic.sel(wide=case).values > 0))
            for case in dynamic["wide"].values
        ),
        comment="more likely, and soon not slightly: by equilibrium, and with inertia, which"
        " carries some of these events through",
    )


@claim(
    where="Sec. 5.4",
    says="With a much larger strength range small events would come first, as in a cascade.",
    needs=("disorder", "sequence"),
    rule=Above(limits.OFTEN),
)
def cascade(data: Data) -> Measured:
    """Arrested events a sample, and how much more often than by chance the last is the largest."""
    study = data["sequence"].isel(case=0)
    counts = study["arrested_events"].values
    moment = study["event_moment"].values
    excess = []
    for row, count in zip(moment, counts, strict=True):
        kept = row[np.isfinite(row)]
        if kept.size >= 2 and count == kept.size:
            excess.append(float(kept[-1] == kept.max()) - 1.0 / kept.size)
    found = mean(excess) if len(excess) > 2 else Estimate(0.0, 1.0)
    usual = data["disorder"]["arrested_events"].sel(case="as it is").values
    sizes = moment[np.isfinite(moment)]
    low, high = np.quantile(sizes, (0.05, 0.95)) if sizes.size else (1.0, 1.0)
    return Measured(
        (Quantity("arrested events a sample", mean(counts.astype(float))),),
        (
            Quantity("the last is the largest, share above chance", found),
            Quantity("arrested events with the paper's range", mean(usual.astype(float))),
            *one("95 % over 5 % of the moments", float(f"{high / low:.2g}")),
        ),
        comment="by equilibrium, four times the range",
    )


@claim(
    where="Abstract, Secs. 5.2 and 5.4",
    says="Arrested fronts need a driving force that is not uniform: a random stress drop does it.",
    needs=("disorder",),
    rule=All(Above(0.0), Softly(Below(limits.SLIGHT))),
)
def random_stress_drop(data: Data) -> Measured:
    """More arrests with a random residual strength; and arrests by wide strength alone."""
    cases = [str(case) for case in data["disorder"]["case"].values]
    if "more random stress drop" not in cases:
        return Measured(((), ()), comment="strength down to the residual one")
    usual, drop = (_share(data, case) for case in ("as it is", "more random stress drop"))
    alone = [usual, _share(data, "four times the range")]
    return Measured(
        ((Quantity("more arrests by it", drop.estimate - usual.estimate),), alone),
        (drop, _share(data, "random stress drop")),
        comments={
            Verdict.CORRECTED: "by equilibrium: it does it, but is not needed where the strength"
            " varies much more than in the paper"
        },
        comment="share of samples with an arrested event, by equilibrium",
    )


@claim(
    where="Sec. 5.2",
    says="Random load on a small scale does not cause arrest.",
    needs=("disorder",),
    rule=Below(limits.UNCOMMON),
)
def random_load(data: Data) -> Measured:
    """Share of arrests with random load as short as the strength, by equilibrium."""
    return Measured(
        (_share(data, "random load"),),
        (_share(data, "as it is"),),
        comment="share of samples with an arrested event, by equilibrium",
    )


@claim(
    where="Sec. 5.2",
    says="At best, random load slightly delays or expedites the onset.",
    needs=("disorder",),
    rule=Below(limits.SLIGHT),
)
def random_load_shift(data: Data) -> Measured:
    """Mean shift of tau_cr by it."""
    study = data["disorder"]
    usual, noisy = (
        study["critical_stress"].sel(case=case).values for case in ("as it is", "random load")
    )
    shift = mean(noisy / usual - 1.0)
    single = mean(np.abs(noisy / usual - 1.0))
    return Measured(
        (Quantity("size of the shift, one sample", single),),
        (Quantity("shift on average", shift),),
        comment="of tau_cr: on average it expedites, since sliding begins where strength less load"
        " is least",
    )


@claim(
    where="Sec. 5.4",
    says="Less variation of the stress drop means larger events, at the same correlation length.",
    needs=("disorder",),
    rule=Above(0.0),
)
def less_disorder_larger(data: Data) -> Measured:
    """More arrests at twice the variation of the residual strength, by equilibrium."""
    cases = [str(case) for case in data["disorder"]["case"].values]
    if "more random stress drop" not in cases:
        return Measured((), comment="strength down to the residual one")
    some, more = (_share(data, c) for c in ("random stress drop", "more random stress drop"))
    return Measured(
        (Quantity("more arrests at twice the variation", more.estimate - some.estimate),),
        (some, more),
        comment="share of samples in which the first event stays small, by equilibrium",
    )
