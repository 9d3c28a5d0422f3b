"""Claims about slip patches: how they grow, merge, become critical, and act on each other."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, Construction
from stiction.papers.albertini2020.claims.measures import at_each, one, values
from stiction.papers.albertini2020.claims.rules import Above, Below, Falling, Graded, Never, Within
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate, mean, share

NEEDS = ("monte_carlo", "interaction")


@claim(
    where="Abstract, Sec. 5.2",
    says="Many patches slip at once, and their number grows with the load.",
    needs=("growth",),
    rule=All(Above(0.0), Above(1.0)),
)
def patches_grow(data: Data) -> Measured:
    """Mean number at 0.92, 0.96 and just below the load of the onset, shortest correlation."""
    study = data["growth"]["patches"].sel(correlation_ratio=data.ratios[0])
    levels = (0.92, 0.96, 0.999)
    numbers = [study.sel(level=level, method="nearest").values for level in levels]
    # The same samples at each load: the steps are known better than the numbers.
    steps = [mean(right - left) for left, right in pairwise(numbers)]
    at = [
        Quantity(f"tau_0 = {level:g} tau_cr", mean(each))
        for level, each in zip(levels, numbers, strict=True)
    ]
    return Measured(
        (tuple(Quantity("more", step) for step in steps), at[-1:]),
        at[:-1],
        comment=f"at xi_0/h_n = {data.ratios[0]:g}, by exact equilibrium",
    )


@claim(
    where="Sec. 5.2",
    says="Patches may merge, the critical one among them.",
    needs=("growth",),
    rule=Above(limits.COMMON),
)
def patches_merge(data: Data) -> Measured:
    """Share of samples whose critical patch has merged, and mergers before the onset."""
    study = data["growth"].sel(correlation_ratio=data.ratios[0])
    critical = share(study["critical_merged"].values > 0)
    return Measured(
        (Quantity("samples whose critical patch merged", critical),),
        (Quantity("mergers a sample", mean(study["mergers"].values[:, -1])),),
        comment=f"at xi_0/h_n = {data.ratios[0]:g}, by exact equilibrium",
    )


@claim(
    where="Sec. 5.2",
    says="The patch that becomes unstable need not be the first to appear.",
    needs=("growth",),
    rule=Above(limits.COMMON),
)
def not_the_first(data: Data) -> Measured:
    """Share of samples whose critical patch does not hold the weakest node."""
    series = at_each(data, lambda r: share(values(data, "growth", "critical_first", r) == 0))
    return Measured(
        series[:1],
        series[1:],
        comment="share of samples, by exact equilibrium; the shortest length, that of the paper's"
        " example, decides",
    )


@claim(
    where="Sec. 3.2 and App. A",
    says="The critical patch is h_n long whatever the profile of strength.",
    needs=NEEDS,
    rule=Graded(limits.ALMOST_ALL, limits.MOST),
)
def critical_length(data: Data) -> Measured:
    """Share of samples whose critical patch is within 10 % of h_n, and where most lie."""
    problem = data.setting.problem
    # A patch has a whole number of nodes.
    slack = limits.SAME_LENGTH.value + problem.interface.spacing / problem.nucleation_length

    def relative(ratio: float) -> np.ndarray:
        return values(data, "interaction", "critical_patch_length", ratio) / (
            problem.nucleation_length
        )

    low, high = np.quantile(relative(data.ratios[0]), [0.05, 0.95])
    return Measured(
        at_each(data, lambda r: share(np.abs(relative(r) - 1.0) <= slack)),
        comment=f"share within 10 %; nine of ten lie between {low:.2f} and {high:.2f} h_n at the"
        " shortest correlation length, where patches merge",
    )


@claim(
    where="Sec. 3.2",
    says="No point reaches its residual strength before the onset.",
    needs=NEEDS,
    rule=Never(limits.RARE),
)
def residual_not_reached(data: Data) -> Measured:
    """Share of samples that reach it without an arrested event before."""

    def reached(ratio: float) -> Estimate:
        early = values(data, "interaction", "residual_reached", ratio) > 0
        return share(early & (values(data, "interaction", "arrested_events", ratio) == 0))

    return Measured(at_each(data, reached), comment="share of samples, by exact equilibrium")


@claim(
    where="Sec. 5.2",
    says="A patch lowers the stress inside it and raises it beside it.",
    needs=("mechanism",),
    rule=All(Below(0.0), Above(0.0)),
)
def stress_beside(data: Data) -> Measured:
    """Stress less load inside, and h_n/4 beside, a single patch about to become unstable."""
    study = data["mechanism"]
    return Measured(
        (
            one("inside, of the load", 100.0 * float(study["stress_inside"]), "%"),
            one("h_n/4 beside it", 100.0 * float(study["stress_beside"]), "%"),
        ),
        one("h_n beside it", 100.0 * float(study["stress_far"]), "%"),
        comment="one smooth dip of the strength, by exact equilibrium",
    )


@claim(
    where="Sec. 5.2",
    says="A near patch makes another one unstable at a lower load; the nearer, the more.",
    needs=("mechanism",),
    rule=Falling(),
)
def neighbours_lower(data: Data) -> Measured:
    """By how much a second dip lowers the onset, against its distance."""
    study = data["mechanism"]
    found = 100.0 * study["lowering"].values
    return Measured(
        tuple(
            Quantity(f"{float(d):g} h_n apart", Estimate(float(value)), "%")
            for d, value in zip(study["distance"].values, found, strict=True)
        ),
        comment="two dips, of which neither knows of the other in the local criterion",
    )


@claim(
    where="Sec. 5.2",
    says="Where the position is misplaced, two patches have very similar critical stress, and the"
    " less critical one is helped by a neighbour.",
    needs=("mechanism", "interaction"),
    rule=All(Below(limits.SCATTER), Above(0.0)),
)
def misplaced_by_neighbours(data: Data) -> Measured:
    """Local criterion at the true place above its minimum; help that the true place has got."""
    study = data["mechanism"]

    def number(name: str) -> Estimate:
        found = Estimate(float(study[name]), float(study[f"{name}_error"]))
        return found.scaled(100.0)

    wrong, right = number("helped_wrong"), number("helped_right")
    return Measured(
        (
            (Quantity("the two differ by", number("contest_wrong"), "%"),),
            (Quantity("more help than where it is right", wrong - right, "%"),),
        ),
        (Quantity("help by interaction, misplaced", wrong, "%"),
         Quantity("help, rightly placed", right, "%")),
        comment=f"of tau_cr at xi_0/h_n = {data.ratios[0]:g}; Figure 13 shows a pair made for it",
    )  # fmt: skip


@claim(
    where="Sec. 3.2 and App. A",
    says="A non-uniform load on uniform strength and a uniform load on non-uniform strength are"
    " one problem.",
    needs=("mechanism",),
    rule=Within(-1e-6, 1e-6, "one problem: to round-off of the solver"),
)
def load_like_strength(data: Data) -> Measured:
    """Relative difference of the onset by exact equilibrium, largest of the samples."""
    return Measured(
        one(
            "largest relative difference",
            float(f"{np.abs(data['mechanism']['equivalence'].values).max():.1g}"),
        ),
        comment="tau_p(x) under a uniform load, against max tau_p with the initial stress"
        " max tau_p - tau_p(x)",
    )


@claim(
    where="Sec. 5.2",
    says="Most patches grow slowly until the onset; only one accelerates.",
    needs=("ruptures",),
    rule=Construction("the onset is the first moment at which one accelerates"),
)
def one_accelerates(data: Data) -> Measured:
    """Slipping patches at the onset by equilibrium, in the simulated samples."""
    first = data.setting.simulated_ratios[0]
    return Measured(
        (Quantity(
            f"patches at the onset, xi_0/h_n = {first:g}",
            mean(values(data, "ruptures", "exact_slip_patches", first)),
        ),)
    )  # fmt: skip
