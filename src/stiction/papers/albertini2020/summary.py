"""What stands on the report page: summary, key numbers, claims, parameters, provenance."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from itertools import product

import numpy as np

from stiction.papers.albertini2020.claims import SUBJECTS, Claim, Finding, Verdict
from stiction.papers.albertini2020.claims.claim import rounded
from stiction.papers.albertini2020.claims.combined_rules import EachReading
from stiction.papers.albertini2020.claims.limits import LIMITS
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import (
    SCATTER,
    displaced,
    fidelity,
    misplaced,
    overprediction,
    scatter,
    shift_of,
    variation,
)
from stiction.papers.albertini2020.provenance import parameters, provenance
from stiction.papers.albertini2020.studies.modulus import READINGS
from stiction.report.page import ShownClaim, ShownFigure, render
from stiction.report.tables import Table
from stiction.statistics.control_variates import combined_mean
from stiction.statistics.estimates import mean, standard_deviation
from stiction.statistics.quantiles import quantiles

TITLE = "Stochastic properties of static friction, recomputed"
SOURCE = (
    "Albertini, Karrer, Grigoriu and Kammer (2020) asked how the strength of an interface varies"
    " when its local strength is random. This page computes their study again and holds their"
    " statements against the results."
)
Judged = Sequence[tuple[Claim, Finding]]


def assemble(
    data: Data,
    figures: Sequence[ShownFigure],
    findings: Judged,
    warnings: Mapping[str, int],
    seconds: float,
) -> str:
    """The page as HTML."""
    return render(
        title=TITLE,
        lead=SOURCE,
        headline=_tally(findings),
        points=_points(data, findings),
        exceptions=_exceptions(findings),
        key_tables=[
            table
            for table in (
                _key_table(data),
                _few_table(data),
                _scatter_table(data),
                _reading_table(findings),
            )
            if table is not None
        ],
        figures=figures,
        claims=_claims(findings),
        limits=limits_table(),
        parameters=parameters(data),
        notes=_notes(warnings),
        provenance=provenance(data, seconds),
    )


def _notes(warnings: Mapping[str, int]) -> list[str]:
    """Each warning once, with the studies in which it came up; without the code it suggests."""
    studies: dict[str, dict[str, int]] = {}
    for text, count in warnings.items():
        study, _, words = text.partition(": ")
        # What to write in a script instead is for scripts.
        words = re.sub(r" ?\([a-z_.]+ ?>=[^)]*\)", "", words)
        words = re.split(r"; [A-Z]\w+\(", words)[0].rstrip(".")
        # Numbers differ from study to study; one of them will do.
        key = re.sub(r"\d[\d.,e+-]*", "#", words)
        kept = next((k for k in studies if re.sub(r"\d[\d.,e+-]*", "#", k) == key), words)
        studies.setdefault(kept, {})[study] = count
    return [f"{words} ({', '.join(where)})." for words, where in studies.items()]


def claims_table(findings: Judged) -> Table:
    """The claims as a file."""
    return Table.of(
        "claims",
        "Claims",
        (
            "claim", "where", "what it says", "printed", "computed", "verdict", "rule", "comment",
            "verdict by elastodynamics", "computed by elastodynamics",
        ),
        (
            (
                claim.name,
                claim.where,
                claim.says,
                claim.printed,
                "; ".join(quantity.text for quantity in finding.computed),
                str(finding.verdict),
                claim.rule.text,
                finding.comment,
                str(other.verdict) if other else "",
                "; ".join(quantity.text for quantity in other.computed) if other else "",
            )
            for claim, finding in findings
            for other in [finding.by_elastodynamics]
        ),
    )  # fmt: skip


def limits_table() -> Table:
    """What the words of the paper are taken to mean, with the reason."""
    return Table.of(
        "limits",
        "What words are taken to mean",
        ("word", "limit", "reason"),
        ((each.word, f"{each.value:g} {each.unit}".strip(), each.reason)
         for each in LIMITS.values()),
    )  # fmt: skip


def _tally(findings: Judged) -> list[tuple[str, int]]:
    counts = [
        (str(verdict), sum(finding.verdict is verdict for _, finding in findings))
        for verdict in Verdict
    ]
    return [(verdict, count) for verdict, count in counts if count]


def _points(data: Data, findings: Judged) -> list[str]:
    points = []
    if findings:
        points.append(
            f"{len(findings)} statements of the paper were judged, by {data.samples:,} samples at"
            f" each of {len(data.ratios)} correlation lengths."
        )
    if "monte_carlo" in data.studies:
        first, last = data.ratios[0], data.ratios[-1]
        stress = {ratio: data.at(ratio)["critical_stress"].values for ratio in data.ratios}
        share = [float(np.mean(stress[ratio])) / data.setting.mean for ratio in (first, last)]
        spread = [float(np.std(stress[ratio])) / data.setting.mean for ratio in data.ratios]
        points.append(
            f"By the local criterion the interface slides at {100 * share[0]:.1f} % of its mean"
            f" strength if the correlation length is {first:g} of the nucleation length, at"
            f" {100 * share[1]:.1f} % if it is {last:g} times as long; samples vary by"
            f" {100 * min(spread):.1f} to {100 * max(spread):.1f} % (standard deviation)."
        )
    if {"monte_carlo", "interaction"} <= set(data.studies):
        bias = [
            100.0 * float(overprediction(data, ratio).mean()) / data.setting.mean
            for ratio in (data.ratios[0], data.ratios[-1])
        ]
        wrong = [
            100.0 * float(misplaced(data, r).mean()) for r in (data.ratios[0], data.ratios[-1])
        ]
        points.append(
            "With every interaction between patches, by exact equilibrium, this changes by"
            f" {-bias[0]:.2g} % of the mean strength at the shortest and {-bias[1]:.1g} % at the"
            " longest correlation length; the local criterion puts the onset in the wrong place in"
            f" {wrong[0]:.2g} and {wrong[1]:.2g} % of samples."
        )
    if "ruptures" in data.studies:
        points.append(_about_ruptures(data))
    if {"dynamic", "interaction", "abundant"} <= set(data.studies):
        points.append(_about_dynamics(data))
    twice = [(claim, finding) for claim, finding in findings if finding.by_elastodynamics]
    if twice:
        points.append(_about_both_verdicts(data, twice))
    if "arrest" in data.studies and data["arrest"].sizes["event"]:
        stay = data["arrest"]["dynamic_arrests"].values > 0
        points.append(
            f"Randomness of strength alone can arrest a rupture, rarely: of {stay.size} samples"
            " whose first instability comes to rest by equilibrium, inertia carries"
            f" {int((~stay).sum())} through and leaves {int(stay.sum())} arrested."
        )
    return points


def _about_ruptures(data: Data) -> str:
    ratios = data.setting.simulated_ratios

    def error(prediction: str) -> float:
        shifts = np.concatenate([shift_of(data, ratio, prediction) for ratio in ratios])
        return 100.0 * float(np.sqrt(np.mean(shifts**2)))

    wrong, runs = (
        sum(int(displaced(data, ratio, "local").sum()) for ratio in ratios),
        data["ruptures"]["critical_stress"].size,
    )
    return (
        f"{runs} elastodynamic ruptures begin at the stress that exact equilibrium predicts to"
        f" {error('exact'):.2g} %, the local criterion to {error('local'):.2g} %, and the formula"
        f" with the printed modulus to {error('printed'):.2g} % (root mean square); in {wrong} of"
        f" {runs} the local criterion puts the onset in the wrong place."
    )


def _about_dynamics(data: Data) -> str:
    pairs = [fidelity(data, ratio) for ratio in data.ratios]
    gaps = [100.0 * float(np.median(dear / exact[: dear.size] - 1.0)) for dear, exact, _ in pairs]
    savings = [combined_mean(*each).saving for each in pairs]
    return (
        f"In {data['dynamic'].sizes['sample']:,} ruptures at each correlation length inertia and"
        f" the loading rate raise the critical stress by {min(gaps):.2g} to {max(gaps):.2g} % over"
        " exact equilibrium (median); with the cheap methods as control variates they"
        f" fix the mean as well as {min(savings):,.0f} to {max(savings):,.0f} times as many would."
    )


def _about_both_verdicts(data: Data, twice: Judged) -> str:
    others = [
        f"\N{LEFT DOUBLE QUOTATION MARK}{claim.says.rstrip('.')}\N{RIGHT DOUBLE QUOTATION MARK}"
        f" ({claim.where}): {found.verdict}, by the ruptures {other.verdict}"
        for claim, found in twice
        if (other := found.by_elastodynamics) and other.verdict is not found.verdict
    ]
    runs = data["dynamic"]["critical_stress"].size
    return (
        f"{len(twice) - len(others)} of {len(twice)} statements about onsets get the same verdict"
        f" from {runs:,} ruptures" + (f"; not so: {'; '.join(others)}." if others else ".")
    )


def _exceptions(findings: Judged) -> list[tuple[str, list[str]]]:
    groups = []
    for verdict, heading in (
        (Verdict.FAILS, "What does not hold"),
        (Verdict.CORRECTED, "What holds with a correction"),
        (Verdict.UNDECIDABLE, "What the text leaves open"),
        (Verdict.OPEN, "What these samples cannot decide"),
    ):
        texts = []
        for claim, finding in findings:
            if finding.verdict is not verdict:
                continue
            says = claim.says.rstrip(".")
            comment = f" Computed: {finding.comment.rstrip('.')}." if finding.comment else ""
            texts.append(f"The paper says: {says} ({claim.where}).{comment}")
        if texts:
            groups.append((heading, texts))
    return groups


def _scatter_table(data: Data) -> Table | None:
    """Three measures of how much tau_cr varies, and the coefficient of variation of mu_s."""
    if "monte_carlo" not in data.studies:
        return None
    rows = []
    for ratio in data.ratios:
        found = [rounded(each.scaled(1e-3)) for each in scatter(data, ratio).values()]
        rows.append((f"{ratio:g}", *found, rounded(variation(data, ratio).scaled(100.0))))
    return Table.of(
        "scatter",
        "How much the critical stress varies (kPa): the paper plots the first",
        ("xi_0/h_n", *SCATTER.values(), "coefficient of variation (%)"),
        rows,
    )


def _reading_table(findings: Judged) -> Table | None:
    """The verdict under each reading of the modulus."""
    rows = [
        (claim.says, *(str(verdict) for verdict in finding.by_reading), str(finding.verdict))
        for claim, finding in findings
        if isinstance(claim.rule, EachReading)
    ]
    if not rows:
        return None
    columns = [f"({key}) {text}" for key, text in READINGS.items()]
    return Table.of(
        "modulus",
        "Which modulus: what each reading of the text makes of the printed results",
        ("the paper says", *columns, "together"),
        rows,
    )


def _key_table(data: Data) -> Table | None:
    by_method = [
        (label, data[study])
        for label, study in (
            ("local criterion", "monte_carlo"),
            ("exact equilibrium", "interaction"),
            ("elastodynamics", "dynamic"),
        )
        if study in data.studies
    ]
    rows = []
    for ratio, (label, study) in product(data.ratios, by_method):
        stress = study["critical_stress"].sel(correlation_ratio=ratio).values
        q = quantiles(stress, (0.05, 0.5, 0.95))
        rows.append(
            (
                f"{ratio:g}",
                label,
                rounded(mean(stress).scaled(1e-6)),
                rounded(standard_deviation(stress).scaled(1e-3)),
                *(f"{value * 1e-6:.4f}" for value in q.value),
                f"{float(np.mean(stress)) / data.setting.mean:.4f}",
            )
        )
    if not rows:
        return None
    return Table.of(
        "critical-stress",
        "Critical stress tau_cr",
        (
            "xi_0/h_n",
            "by",
            "mean (MPa)",
            "st. dev. (kPa)",
            "5 % (MPa)",
            "median",
            "95 %",
            "mean/<tau_p>",
        ),
        rows,
    )


def _again(finding: Finding) -> tuple[str, ...]:
    """What elastodynamics says of the same statement."""
    other = finding.by_elastodynamics
    if other is None:
        return ()
    numbers = "; ".join(quantity.text for quantity in other.computed)
    return (f"By elastodynamics: {other.verdict}.", numbers)


def _few_table(data: Data) -> Table | None:
    """What as few simulations as the paper's say of the distribution, and what many samples say."""
    many = [
        (label, data[study])
        for label, study in (("equilibrium", "interaction"), ("elastodynamics", "dynamic"))
        if study in data.studies
    ]
    ratios = [ratio for ratio in data.setting.simulated_ratios if ratio in data.ratios]
    if "ruptures" not in data.studies or not many or not ratios:
        return None
    rows = []
    for ratio in ratios:
        runs = data["ruptures"].sel(correlation_ratio=ratio)["critical_stress"].values
        if runs.size < 3:
            return None
        for label, study in many:
            every = study["critical_stress"].sel(correlation_ratio=ratio).values
            row = [f"{ratio:g}", f"{runs.size} against {every.size:,} by {label}"]
            for of in (mean, standard_deviation):
                few, all_of_them = of(runs).scaled(1e-3), of(every).scaled(1e-3)
                apart = few - all_of_them
                row += [
                    rounded(few), rounded(all_of_them), f"{apart.value / apart.error:+.1f}"
                ]  # fmt: skip
            rows.append(tuple(row))
    return Table.of(
        "few-and-many",
        "What few ruptures tell of the critical stress, and what many samples do (kPa)",
        (
            "xi_0/h_n", "ruptures", "mean of the few", "mean of the many",
            "means apart by (errors)", "st. dev. of the few", "st. dev. of the many",
            "deviations apart by (errors)",
        ),
        rows,
    )  # fmt: skip


def _claims(findings: Judged) -> list[tuple[str, list[ShownClaim]]]:
    groups: dict[str, list[ShownClaim]] = {subject: [] for subject in SUBJECTS}
    for claim, finding in findings:
        groups.setdefault(claim.subject, []).append(
            ShownClaim(
                claim.where,
                claim.says,
                claim.printed,
                tuple(quantity.text for quantity in finding.computed),
                str(finding.verdict),
                finding.comment,
                claim.rule.text,
                _again(finding),
            )
        )
    return [(SUBJECTS.get(key, key), members) for key, members in groups.items() if members]
