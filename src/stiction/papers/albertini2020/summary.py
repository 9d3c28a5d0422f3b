"""What stands on the report page: summary, key numbers, claims, parameters, provenance."""

from __future__ import annotations

import platform
import time
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from itertools import product
from typing import Any

import numpy as np

from stiction import __version__
from stiction.papers.albertini2020.claims import SUBJECTS, Claim, Finding, Verdict
from stiction.papers.albertini2020.claims.claim import rounded
from stiction.papers.albertini2020.claims.rules import kilopascal, megapascal
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import (
    displaced,
    fidelity,
    misplaced,
    overprediction,
    shift_of,
)
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
_PACKAGES = ("numpy", "scipy", "numba", "rocket-fft", "xarray", "netCDF4", "pydantic", "matplotlib")
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
        key_table=_key_table(data),
        figures=figures,
        claims=_claims(findings),
        parameters=_parameters(data),
        notes=[
            f"{text} ({count} times)" if count > 1 else text for text, count in warnings.items()
        ],
        provenance=_provenance(data, seconds),
    )


def claims_table(findings: Judged) -> Table:
    """The claims as a file."""
    return Table.of(
        "claims",
        "Claims",
        ("claim", "where", "what it says", "printed", "computed", "verdict", "comment"),
        (
            (
                claim.name,
                claim.where,
                claim.says,
                claim.printed,
                "; ".join(quantity.text for quantity in finding.computed),
                str(finding.verdict),
                finding.comment,
            )
            for claim, finding in findings
        ),
    )


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
            "Exact equilibrium with every interaction between patches lowers this by"
            f" {bias[0]:.2g} % of the mean strength at the shortest and {bias[1]:.1g} % at the"
            " longest correlation length; the local criterion puts the onset in the wrong place in"
            f" {wrong[0]:.2g} and {wrong[1]:.2g} % of samples."
        )
    if "ruptures" in data.studies:
        points.append(_about_ruptures(data))
    if {"dynamic", "interaction", "abundant"} <= set(data.studies):
        points.append(_about_dynamics(data))
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


def _exceptions(findings: Judged) -> list[tuple[str, list[str]]]:
    groups = []
    for verdict, heading in (
        (Verdict.FAILS, "What does not hold"),
        (Verdict.CORRECTED, "What holds with a correction"),
        (Verdict.OPEN, "What these samples cannot decide"),
    ):
        texts = []
        for claim, finding in findings:
            if finding.verdict is not verdict:
                continue
            comment = f": {finding.comment}" if finding.comment else ""
            texts.append(f"{claim.says.rstrip('.')} ({claim.where}){comment}.")
        if texts:
            groups.append((heading, texts))
    return groups


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
                rounded(megapascal(mean(stress))),
                rounded(kilopascal(standard_deviation(stress))),
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
            )
        )
    return [(SUBJECTS.get(key, key), members) for key, members in groups.items() if members]


def _parameters(data: Data) -> list[tuple[str, str]]:
    setting = data.setting
    problem = setting.problem
    solid, interface = problem.solid, problem.interface
    rate = float(np.max(problem.friction.weakening_rate))
    length = problem.nucleation_length
    deviation = setting.field(data.ratios[0]).standard_deviation
    return [
        (
            "Solid",
            f"G = {solid.shear_modulus:g} Pa, nu = {solid.poisson_ratio:g},"
            f" rho = {solid.density:g} kg/m^3, plane {solid.plane}",
        ),
        ("Effective modulus", f"G* = {problem.effective_modulus:.6g} Pa (mode {problem.mode})"),
        ("Interface", f"L = {interface.length:g} m, {interface.size} nodes"),
        (
            "Friction",
            f"W = {rate:g} Pa/m, residual strength"
            f" {float(np.mean(problem.friction.residual_strength)):g} Pa",
        ),
        (
            "Nucleation length",
            f"h_n = {length * 1e3:.4g} mm, L/h_n ="
            f" {interface.extent / length:.4g},"
            f" {length / interface.spacing:.1f} nodes",
        ),
        (
            "Strength",
            f"{_marginal(setting.marginal)}; mean {setting.mean * 1e-6:.6g} MPa,"
            f" standard deviation {deviation * 1e-6:.4g} MPa",
        ),
        (
            "Spectrum",
            f"(k^2 + lambda^2)^-{setting.exponent:g}, truncated at"
            f" {setting.truncation:g} lambda, {'with' if setting.mean_mode else 'without'} the mean"
            " mode",
        ),
        ("Correlation lengths", "xi_0/h_n = " + ", ".join(f"{ratio:g}" for ratio in data.ratios)),
        ("Samples", f"{data.samples:,} at each correlation length, seed {data.seed}"),
        ("Ruptures", _rupture_counts(data)),
    ]


def _rupture_counts(data: Data) -> str:
    parts = []
    if "ruptures" in data.studies:
        study = data["ruptures"]
        ratios = ", ".join(f"{ratio:g}" for ratio in data.setting.simulated_ratios)
        parts.append(
            f"{study.sizes['sample']} at each of xi_0/h_n = {ratios}, at"
            f" {study.attrs['loading_rate']:g} Pa/s"
        )
    if "dynamic" in data.studies:
        parts.append(f"{data['dynamic'].sizes['sample']:,} at each correlation length")
    return "; ".join(parts) or "none"


def _marginal(marginal: Any) -> str:
    if hasattr(marginal, "alpha"):
        return (
            f"Beta({marginal.alpha:g}, {marginal.beta:g}) on"
            f" [{marginal.low * 1e-6:g}, {marginal.high * 1e-6:g}] MPa"
        )
    given = ", ".join(f"{key} = {value:g}" for key, value in marginal.parameters)
    return f"{marginal.type} with {given}"


def _provenance(data: Data, seconds: float) -> list[tuple[str, str]]:
    versions = []
    for package in _PACKAGES:
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    times = ", ".join(
        f"{dataset.attrs['title']} {dataset.attrs['seconds']:.1f} s"
        for dataset in data.studies.values()
    )
    return [
        ("Computed", time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())),
        ("stiction", __version__),
        ("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
        ("Packages", ", ".join(versions)),
        ("Time taken", f"{seconds:.1f} s before this page was written"),
        ("Studies", times or "none"),
        ("Results", "results.nc (one group a study), tables/*.csv, figures/*.png and *.pdf"),
        (
            "Local criterion",
            "local criterion of Uenishi and Rice (2003), exact eigenfunction, minimum"
            " between the nodes",
        ),
    ]
