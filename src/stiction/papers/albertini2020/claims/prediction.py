"""Claims about the simulations, and how well the theory describes what they find."""

from __future__ import annotations

import numpy as np

from stiction.ensemble.scheduler import usable_cores
from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, Construction
from stiction.papers.albertini2020.claims.measures import (
    at_each,
    at_simulated,
    labelled,
    one,
    root_mean_square,
    values,
)
from stiction.papers.albertini2020.claims.rules import Below, Falling, Graded
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import (
    displaced,
    dynamic_mean,
    misplaced,
    overprediction,
    shift_of,
)
from stiction.papers.albertini2020.studies.spectrum import relative_changes
from stiction.statistics.estimates import Estimate, mean, share

NEEDS = ("ruptures",)


@claim(
    where="Sec. 5.2",
    says="Interaction of patches is what the theory lacks: with it the onset is that of the"
    " simulations.",
    needs=NEEDS,
    onsets_of="ruptures",
    rule=Below(limits.AS_ONE),
)
def interaction_suffices(data: Data) -> Measured:
    """Mean error of exact equilibrium against elastodynamics; of the other predictions beside."""

    def error(prediction: str) -> tuple[Quantity, ...]:
        return at_simulated(
            data,
            lambda r: root_mean_square(100.0 * shift_of(data, r, prediction)),
            "%",
            prediction,
        )

    exact = at_simulated(
        data, lambda r: _absolute(mean(100.0 * shift_of(data, r, "exact"))), "%", "exact"
    )
    return Measured(
        exact,
        (*error("local"), *error("printed")),
        comment="error of equilibrium, mean, and of the local criterion with the modulus of the"
        " plane state and with the printed one, root mean square; what is left is inertia and the"
        " loading rate",
    )


def _absolute(each: Estimate) -> Estimate:
    return Estimate(abs(each.value), each.error)


@claim(
    where="Secs. 3.3 and 5.2",
    says="Where the position is wrong the critical stress is still predicted correctly.",
    needs=("monte_carlo", "interaction"),
    onsets_of="interaction",
    rule=Graded(limits.ALMOST_ALL, limits.MOST),
)
def stress_still_right(data: Data) -> Measured:
    """Share of the misplaced whose error is below what samples differ by, and the mean error."""
    wrong = np.concatenate([misplaced(data, ratio) for ratio in data.ratios])
    exact = [values(data, "interaction", "first_instability", ratio) for ratio in data.ratios]
    errors = [
        100.0 * overprediction(data, ratio) / stress
        for ratio, stress in zip(data.ratios, exact, strict=True)
    ]
    found = np.concatenate(errors)[wrong]
    if found.size < 3:
        return Measured((Quantity("too few misplaced", Estimate(1.0, 1.0)),))
    return Measured(
        (Quantity("share of the misplaced within 3 %", share(found < limits.SCATTER.value)),),
        tuple(
            Quantity(f"mean error, xi_0/h_n = {ratio:g}", mean(each[where]), "%")
            for ratio, each in zip(data.ratios, errors, strict=True)
            if (where := misplaced(data, ratio)).sum() >= 5
        ),
        comment="over-prediction by the local criterion against exact equilibrium",
    )


@claim(
    where="Sec. 3.3, Fig. 4b, Conclusion",
    says="The critical stress of the simulations rises with decreasing correlation length.",
    needs=("ruptures", "interaction"),
    onsets_of="ruptures",
    rule=Falling(),
)
def simulations_trend(data: Data) -> Measured:
    """Mean over the runs; with exact equilibrium of all samples as control variate."""
    ratios = [ratio for ratio in data.setting.simulated_ratios if ratio in data.ratios]
    if len(ratios) < 2 or data["ruptures"].sizes["sample"] < 3:
        return Measured(
            at_simulated(
                data,
                lambda r: mean(values(data, "ruptures", "critical_stress", r)).scaled(1e-6),
                "MPa",
            ),
            comment="mean over the runs",
        )
    best = [dynamic_mean(data, ratio) for ratio in ratios]
    return Measured(
        labelled(ratios, [each.estimate.scaled(1e-6) for each in best], "MPa"),
        comment="the error is that of "
        + ", ".join(f"{each.saving:,.0f}" for each in best)
        + " times as many runs, thanks to equilibrium as control variate",
    )


@claim(
    where="Sec. 3.3",
    says="The critical stress of a simulation is its loading rate times the time of onset.",
    needs=NEEDS,
    rule=Below(limits.AS_ONE),
)
def applied_load(data: Data) -> Measured:
    """Load applied at the peak over the peak of the mean stress, less one."""

    def excess(ratio: float) -> Estimate:
        peak = values(data, "ruptures", "critical_stress", ratio)
        return mean(100.0 * (values(data, "ruptures", "applied_load", ratio) / peak - 1.0))

    return Measured(
        at_simulated(data, excess, "%"),
        comment="the applied load exceeds the mean stress on the interface by so much, which is"
        " radiated",
    )


@claim(
    where="Sec. 2.1, Fig. 1b",
    says="Once the interface slides its mean stress is the uniform residual strength.",
    needs=NEEDS,
    rule=Construction("every node is at its residual strength when sliding is declared"),
)
def kinetic_level(data: Data) -> Measured:
    """Mean stress when every node has weakened."""
    return Measured(
        at_simulated(
            data,
            lambda r: mean(values(data, "ruptures", "kinetic_stress", r).round(-1)).scaled(1e-3),
            "kPa",
        )
    )


@claim(
    where="Sec. 5.4",
    says="A shorter correlation length, by a higher onset, releases more: larger earthquakes.",
    needs=NEEDS,
    rule=Falling(),
)
def larger_moment(data: Data) -> Measured:
    """Seismic moment until the whole interface slides, mean over the runs."""
    return Measured(
        at_simulated(
            data, lambda r: mean(values(data, "ruptures", "seismic_moment", r) * 1e-3), "kN"
        ),
        at_simulated(
            data, lambda r: mean(values(data, "ruptures", "stress_drop", r) * 1e-3), "kPa", "drop"
        ),
        comment="moment per length when the last node has weakened, and stress drop",
    )


@claim(
    where="Sec. 3.1",
    says="The simulations have converged in grid, loading rate and time step.",
    needs=("convergence",),
    rule=Below(limits.CONVERGED),
)
def converged(data: Data) -> Measured:
    """Change of tau_cr with other grids, rates and steps."""
    stress = data["convergence"]["critical_stress"]
    usual = stress.values[0]
    computed = tuple(
        Quantity(str(label), Estimate(float(f"{100.0 * np.abs(row / usual - 1.0).max():.2g}")), "%")
        for label, row in zip(stress["case"].values[1:], stress.values[1:], strict=True)
    )
    return Measured(
        computed,
        comment=f"largest change of tau_cr over {stress.sizes['sample']} samples, at the shortest"
        " correlation length",
    )


@claim(
    where="Sec. 4",
    says="A Monte Carlo study of the full dynamic problem would be computationally daunting.",
    needs=NEEDS,
    rule=Graded(limits.DAUNTING, limits.HOURS),
)
def daunting(data: Data) -> Measured:
    """Time of 10,000 ruptures at each correlation length on all cores of this machine."""
    study, cores = data["ruptures"], usable_cores()
    seconds = float(study.attrs["seconds"]) / study["critical_stress"].size
    hours = seconds * 1e4 * len(data.ratios) / cores / 3600.0
    most = max(
        data[name].sizes["sample"] for name in ("ruptures", "dynamic") if name in data.studies
    )
    return Measured(
        one("10,000 at each correlation length", float(f"{hours:.2g}"), "h"),
        one("processor time of one rupture", float(f"{seconds:.2g}"), "s"),
        comment=f"{hours:.2g} hours on {cores} core{'s' * (cores > 1)} of this machine, with memory"
        f" of constant size; {most:,} ruptures at each correlation length were computed for this"
        " page",
    )


@claim(
    where="Abstract, Sec. 4, Conclusion",
    says="The theory gives an accurate description of the distribution of the critical stress.",
    needs=("monte_carlo", "interaction"),
    onsets_of="interaction",
    rule=All(Below(limits.ACCURATE_MEAN), Below(limits.ACCURATE_SPREAD)),
)
def distribution_described(data: Data) -> Measured:
    """Means and standard deviations by the local criterion against exact equilibrium."""

    def changes(study: str, name: str, label: str) -> tuple[Quantity, ...]:
        def change(ratio: float) -> Estimate:
            exact = values(data, study, "critical_stress", ratio)
            local = data.at(ratio)["critical_stress"].values[: exact.size]
            found = relative_changes(local, exact[: local.size])[name].scaled(100.0)
            return _absolute(found)

        return at_each(data, change, "%", label)

    beside: tuple[Quantity, ...] = ()
    if "dynamic" in data.studies:
        beside = (
            *changes("dynamic", "mean", "mean, elastodynamics"),
            *changes("dynamic", "deviation", "st. dev., elastodynamics"),
        )
    return Measured(
        (
            changes("interaction", "mean", "mean"),
            changes("interaction", "deviation", "st. dev."),
        ),
        beside,
        comment="local criterion against exact equilibrium on the same samples, which"
        f" elastodynamics confirms; {_misplaced_runs(data)}",
    )


def _misplaced_runs(data: Data) -> str:
    if "ruptures" not in data.studies:
        return "no ruptures were run"
    ratios = data.setting.simulated_ratios
    runs = data["ruptures"]["critical_stress"].size
    wrong = sum(int(displaced(data, ratio, "local").sum()) for ratio in ratios)
    return f"among {runs} ruptures it misplaces {wrong}"
