"""Claims about the accuracy of the theory, judged by exact equilibrium on the same samples."""

from __future__ import annotations

import numpy as np

from stiction.papers.albertini2020.claims.claim import Finding, Quantity, Verdict, claim
from stiction.papers.albertini2020.claims.rules import (
    above,
    at_each,
    below,
    falling,
    megapascal,
    worst,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import misplaced, overprediction
from stiction.statistics.estimates import Estimate, mean, share

NEEDS = ("monte_carlo", "interaction")
SIMULATED = (0.25, 0.5, 2.0)
"""Correlation lengths at which the paper ran its simulations, 20 at each."""
RUNS = 20


def _exact(data: Data, ratio: float, name: str) -> np.ndarray:
    values: np.ndarray = data["interaction"][name].sel(correlation_ratio=ratio).values
    return values


def _relative_bias(data: Data) -> list[Estimate]:
    """Mean over-prediction in per cent of the mean critical stress."""
    return [
        mean(overprediction(data, ratio)).scaled(
            100.0 / float(_exact(data, ratio, "first_instability").mean())
        )
        for ratio in data.ratios
    ]


@claim(
    where="Abstract, Secs. 3.3 and 6",
    says="The static criterion predicts the onset quantitatively well.",
    needs=NEEDS,
)
def good_prediction(data: Data) -> Finding:
    """Root mean square error in per cent of the stress, against 1 %."""
    series = []
    for ratio in data.ratios:
        relative = 100.0 * overprediction(data, ratio) / _exact(data, ratio, "first_instability")
        square = mean(relative**2)
        root = float(np.sqrt(square.value))
        series.append(Estimate(root, square.error / (2.0 * root)))
    return Finding(
        at_each(data, series, "%"),
        worst([below(each, 1.0) for each in series]),
        "root mean square error, with the modulus of the plane state",
    )


@claim(
    where="Secs. 3.3 and 4.2, Conclusion",
    says="The theory predicts slightly too high a stress, the more so the shorter the correlation.",
    needs=NEEDS,
)
def overpredicts(data: Data) -> Finding:
    """Mean over-prediction at each correlation length."""
    series = _relative_bias(data)
    verdict = worst([falling(series), *(above(each, 0.0) for each in series)])
    return Finding(at_each(data, series, "%"), verdict, "too high by so much on average")


@claim(
    where="Sec. 4.2, Fig. 6b",
    says="From xi_0 = 0.5 h_n on, theory and simulation coincide.",
    needs=NEEDS,
)
def coincide(data: Data) -> Finding:
    """Mean over-prediction from 0.5 on, against 0.5 %."""
    chosen = [
        (ratio, bias)
        for ratio, bias in zip(data.ratios, _relative_bias(data), strict=True)
        if ratio >= 0.5
    ]
    if not chosen:
        return Finding((), Verdict.OPEN, "no such correlation length in this study")
    return Finding(
        tuple(Quantity(f"xi_0/h_n = {ratio:g}", bias, "%") for ratio, bias in chosen),
        worst([below(bias, 0.5) for _, bias in chosen]),
    )


@claim(
    where="Secs. 4.2 and 5.2, Conclusion",
    says="The over-prediction at short correlation length comes from interaction of patches.",
    needs=NEEDS,
)
def interaction_explains(data: Data) -> Finding:
    """Share of interaction in the error of the printed formula, on the same samples."""
    ratio = data.ratios[0]
    stress = _exact(data, ratio, "first_instability")
    unit = 100.0 / float(stress.mean())
    own = overprediction(data, ratio) * unit
    whole = (_exact(data, ratio, "printed_first_instability") - stress) * unit
    part = float(own.mean() / whole.mean())
    found = Estimate(part, mean(own - part * whole).error / abs(float(whole.mean())))
    if found.value >= 0.5:
        verdict = Verdict.HOLDS
    else:
        verdict = Verdict.CORRECTED if found.value >= 0.1 else Verdict.FAILS
    return Finding(
        (
            Quantity(f"error of the printed formula, xi_0/h_n = {ratio:g}", mean(whole), "%"),
            Quantity("left with the modulus of the plane state", mean(own), "%"),
            Quantity("share of interaction", found),
        ),
        verdict,
        "" if verdict is Verdict.HOLDS else "the smaller part: the printed modulus does more",
    )


@claim(
    where="Sec. 3.3, Fig. 4c",
    says="The position of onset is predicted wrongly in 8 of 60 simulations.",
    printed="8 of 60",
    needs=NEEDS,
)
def wrong_positions(data: Data) -> Finding:
    """Expected number in 20 runs at each of the paper's correlation lengths, and its scatter."""
    chosen = [ratio for ratio in data.ratios if ratio in SIMULATED] or list(data.ratios)

    def expected(printed: bool) -> Estimate:
        shares = [share(misplaced(data, ratio, printed=printed)).value for ratio in chosen]
        scatter = np.sqrt(RUNS * sum(p * (1.0 - p) for p in shares))
        return Estimate(RUNS * sum(shares), float(scatter))

    own, formula = expected(False), expected(True)
    # The paper's count is one draw: its scatter, not the error of ours, decides.
    verdict = Verdict.HOLDS if abs(formula.value - 8.0) <= 2.0 * formula.error else Verdict.FAILS
    return Finding(
        (
            Quantity(f"expected of {RUNS * len(chosen)} with the printed modulus", formula),
            Quantity("with that of the plane state", own),
        ),
        verdict,
        "more than h_n/2 off; the errors are the scatter from one set of runs to the next",
    )


@claim(
    where="Secs. 3.3 and 5.2",
    says="Wrong positions are more likely at short correlation length.",
    needs=NEEDS,
)
def wrong_positions_short(data: Data) -> Finding:
    """Share of misplaced onsets at each correlation length."""
    series = [share(misplaced(data, ratio)) for ratio in data.ratios]
    return Finding(at_each(data, series), falling(series))


@claim(
    where="Secs. 3.3 and 5.2",
    says="Where the position is wrong the critical stress is still predicted well.",
    needs=NEEDS,
)
def stress_still_right(data: Data) -> Finding:
    """Mean over-prediction among the misplaced, in per cent, against 2 %."""
    computed, verdicts = [], []
    for ratio in data.ratios:
        wrong = misplaced(data, ratio)
        if wrong.sum() < 5:
            continue
        relative = 100.0 * overprediction(data, ratio) / _exact(data, ratio, "first_instability")
        found = mean(relative[wrong])
        computed.append(Quantity(f"xi_0/h_n = {ratio:g}", found, "%"))
        verdicts.append(below(found, 2.0))
    return Finding(
        tuple(computed), worst(verdicts) if verdicts else Verdict.OPEN, "mean over-prediction"
    )


@claim(
    where="Sec. 5.2",
    says="At the shortest correlation length 20 to 30 patches slip by the time of onset.",
    printed="20 to 30",
    needs=NEEDS,
)
def patches_at_onset(data: Data) -> Finding:
    """Mean number of slipping patches at the first instability."""
    series = [mean(_exact(data, ratio, "slip_patches")) for ratio in data.ratios]
    low, high = np.quantile(_exact(data, data.ratios[0], "slip_patches"), [0.05, 0.95])
    first = series[0].value
    if 20.0 <= first <= 30.0:
        verdict = Verdict.HOLDS
    else:
        verdict = Verdict.CORRECTED if low <= 30.0 and high >= 20.0 else Verdict.FAILS
    return Finding(
        at_each(data, series),
        verdict,
        f"mean numbers; {low:.0f} to {high:.0f} in nine samples of ten at the shortest",
    )


@claim(
    where="Secs. 3.2 and App. A",
    says="The critical patch is h_n long whatever the profile of strength.",
    needs=NEEDS,
)
def critical_length(data: Data) -> Finding:
    """Share of samples whose critical patch is within 10 % of h_n, and the median length."""
    problem = data.setting.problem
    # A patch has a whole number of nodes.
    slack = 0.1 + problem.interface.spacing / problem.nucleation_length
    relative = {
        ratio: _exact(data, ratio, "critical_patch_length") / problem.nucleation_length
        for ratio in data.ratios
    }
    series = [share(np.abs(relative[ratio] - 1.0) <= slack) for ratio in data.ratios]
    least = min(each.value for each in series)
    if least >= 0.95:
        verdict = Verdict.HOLDS
    else:
        verdict = Verdict.CORRECTED if least >= 0.5 else Verdict.FAILS
    first = relative[data.ratios[0]]
    low, high = np.quantile(first, [0.05, 0.95])
    comment = (
        f"nine of ten lie between {low:.2f} and {high:.2f} h_n at the shortest correlation length,"
        " where patches merge (computed: share within 10 %)"
    )
    return Finding(at_each(data, series), verdict, comment)


@claim(
    where="Sec. 3.2",
    says="No point reaches its residual strength before the onset.",
    needs=NEEDS,
)
def residual_not_reached(data: Data) -> Finding:
    """Share of samples that reach it without an arrested event before."""
    series = [
        share(
            (_exact(data, ratio, "residual_reached") > 0)
            & (_exact(data, ratio, "arrested_events") == 0)
        )
        for ratio in data.ratios
    ]
    none = all(each.value == 0.0 for each in series)
    rare = max(each.value for each in series) < 0.01
    verdict = Verdict.HOLDS if none else Verdict.CORRECTED if rare else Verdict.FAILS
    return Finding(at_each(data, series), verdict, "share of samples")


@claim(
    where="Sec. 5.2",
    says="A patch that has become unstable runs along the whole interface, always.",
    needs=NEEDS,
)
def always_runs_away(data: Data) -> Finding:
    """Share of samples with an instability that comes to rest, by equilibrium."""
    series = _arrested(data)
    some = max(each.value for each in series)
    verdict = Verdict.HOLDS if some == 0.0 else Verdict.CORRECTED if some < 0.01 else Verdict.FAILS
    return Finding(
        at_each(data, series),
        verdict,
        f"in up to {100.0 * some:.2g} % of samples an event comes to rest by equilibrium; inertia,"
        " left out here, may carry it through"
        if some
        else "share with an arrested event",
    )


@claim(
    where="Abstract, Sec. 5.2, Conclusion",
    says="Random strength alone makes precursory events extremely unlikely.",
    needs=NEEDS,
)
def precursors_unlikely(data: Data) -> Finding:
    """The same shares, against 1 %."""
    series = _arrested(data)
    return Finding(at_each(data, series), worst([below(each, 0.01) for each in series]), "share")


def _arrested(data: Data) -> list[Estimate]:
    return [share(_exact(data, ratio, "arrested_events") > 0) for ratio in data.ratios]


@claim(
    where="Sec. 3.3, Fig. 4b",
    says="The measured critical stress, too, rises with decreasing correlation length.",
    needs=NEEDS,
)
def exact_trend(data: Data) -> Finding:
    """Mean critical stress by exact equilibrium."""
    series = [megapascal(mean(_exact(data, ratio, "critical_stress"))) for ratio in data.ratios]
    return Finding(at_each(data, series, "MPa"), falling(series))


@claim(
    where="Sec. 4",
    says="A Monte Carlo study of the full problem would be computationally daunting.",
    needs=NEEDS,
)
def daunting(data: Data) -> Finding:
    """Time that it took with all interactions of patches, but without inertia."""
    seconds = float(data["interaction"].attrs["seconds"])
    count = float(data["interaction"].sizes["sample"] * len(data.ratios))
    return Finding(
        (
            Quantity("samples", Estimate(count)),
            Quantity("time on this machine", Estimate(round(seconds, 1)), "s"),
        ),
        Verdict.HOLDS if seconds / count > 1.0 else Verdict.CORRECTED,
        "not for its quasi-static onset with all interactions; inertia costs more",
    )
