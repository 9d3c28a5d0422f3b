"""A design as a self-contained HTML page for the files, which prints on A4."""

import math
from collections.abc import Callable, Mapping, Sequence
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from stiction import plot
from stiction.base.errors import InputError
from stiction.base.files import write_whole
from stiction.base.model import to_plain
from stiction.base.units import in_words
from stiction.base.variables import UNITS
from stiction.cli.report import Page
from stiction.ensemble.batches import versions
from stiction.inference.standards import WHY
from stiction.plot.style import PAGE, paper_style
from stiction.problem.problem import Problem
from stiction.reliability.answer import Answer, unseen_batch

MAX_SHOWN_VALUES = 8
"""Values of an input that are listed."""
LIGHT = ("positive entries",)
"""Words of doubts that are a matter of the grid, and come last."""


def write_page(
    design: Answer, place: Path, evidence: Sequence[Any], sources: Mapping[str, str], title: str
) -> Path:
    """Write a design as an HTML page. See `Answer.write_page`."""
    if not design.of_stress:
        raise InputError("design: must come from st.design_stress, got a failure probability")
    page = Page(title)
    page.text(f"{date.today().isoformat()}; stiction, {versions()}.")
    page.table("Design", ["quantity", "value"], _numbers(design))
    page.text(
        "The interval holds the error of the computation: sampling, and the list of equally likely"
        " interfaces. Uncertainty of the parameters is in the force itself, which is for the mean"
        " probability over all of them. Constants that were assumed are not in it: see below."
    )
    if design.sensitivities.sizes.get("source"):
        with paper_style():
            count = design.sensitivities.sizes["source"]
            figure = Figure(figsize=(0.75 * PAGE, 1.2 + 0.3 * count), layout="constrained")
            plot.sensitivities(design, ax=figure.subplots())
            page.figure(figure, "What moves the design. The band is its interval.")
        page.table("What moves the design", *_moves(design))
    problem, random = design.experiment.problem, design.experiment.random
    page.table("Inputs", ["input", "value", "unit", "source"], _inputs(problem, sources))
    source = random.source
    basis = [source or design.experiment.given, getattr(source, "agreement", None)]
    basis += [getattr(source, "peaks", None), *evidence]
    texts = {f"{type(item).__name__}: {item!r}": item for item in basis if item is not None}
    for text, item in texts.items():
        page.listing(f"Evidence: {type(item).__name__}", text.partition(": ")[2])
    peaks = getattr(source, "peaks", None)
    if peaks is not None and peaks.unit == "1":
        page.table("Slip tests", *_slip_tests(peaks.loads or peaks))
        rows = [
            [name, f"{value:.4g}", WHY.get(name, "")] for name, value in peaks.standards.items()
        ]
        page.table(
            "Slip factors by the standards", ["quantity", "value", "why it differs"], rows
        )
    if assumptions := getattr(source, "assumptions", ()):
        page.table("Assumptions", ["assumption"], [[text] for text in assumptions])
    doubts = [*design.doubts, *unseen_batch(design.specimens), *design.warnings]
    for item in evidence:
        doubts += [*getattr(item, "doubts", ()), *getattr(item, "notes", ())]
    # A matter of the grid weighs least.
    doubts.sort(key=lambda text: any(word in text for word in LIGHT))
    page.table("Doubts", ["doubt"], [[text] for text in dict.fromkeys(doubts or ["none"])])
    page.text(_repeat(design))
    write_whole(place, page.html().encode())
    return place


def _slip_tests(peaks: Any) -> tuple[list[str], list[list[str]]]:
    """Return the headings and rows for the table of slip loads, in the words of EN 1090-2."""
    rows = []
    for kind, factors in enumerate(peaks.values):
        names = peaks.specimens[kind] if peaks.specimens else range(1, factors.size + 1)
        forces = (
            peaks.normal_forces[kind] if peaks.normal_forces else np.full(factors.size, np.nan)
        )
        for name, factor, force in zip(names, factors, forces, strict=True):
            loads = [in_words("N", value) for value in (force, peaks.surfaces * factor * force)]
            rows.append([str(name), *loads, f"{factor:.4g}"])
    return ["specimen", "clamping force", "slip load", "slip factor"], rows


def _repeat(design: Answer) -> str:
    """Return a sentence with all that a checker needs, besides data, to repeat the design."""
    method, seed = design.experiment.method, design.experiment.seed
    source: Any = design.experiment.random.source
    of_tests = f", seed of infer {source.seed}" if hasattr(source, "seed") else ""
    return (
        f"To repeat: stiction {versions()}, method {method!r}, seed {seed}{of_tests}. The force is"
        " that of one friction surface of the interface above."
    )


def _demand(design: Answer) -> tuple[str, Callable[[float], str]]:
    """Return 'force' or 'stress', and a function that words this demand for a stress, Pa."""
    if math.isnan(design.area):
        return "stress", partial(in_words, "Pa")
    return "force", lambda stress: in_words("N", design.area * stress)


def _numbers(design: Answer) -> list[list[str]]:
    """Return the rows for the table of results. Unknown optional quantities are left out."""

    name, shown = _demand(design)
    low, high = map(shown, design.interval["stress"])
    rows = {
        f"design {name}": shown(design.stress),
        "90 % interval of the computation": f"{low} to {high}",
        "target probability of failure": f"{design.probability:g}",
        "reliability index β": f"{design.reliability_index:.3g}",
        f"characteristic value (5 %, confidence {100.0 * design.confidence:g} %)": shown(
            design.characteristic_stress
        ),
        "partial factor (characteristic over design value)": f"{design.partial_factor:.3g}",
        "mean shear stress": in_words("Pa", design.stress),
        "friction coefficient": f"{design.friction_coefficient:.4g}",
        "algorithm": f"{design.algorithm}, {design.evaluations} evaluations",
    }
    optional = ("characteristic", "partial", "friction")
    return [
        [title, text]
        for title, text in rows.items()
        if not (title.startswith(optional) and text.startswith("nan"))
    ]


def _moves(design: Answer) -> tuple[list[str], list[list[str]]]:
    """Return the headings and rows for the table of sensitivities."""
    (name, shown), effects = _demand(design), design.sensitivities
    at_low, at_high = effects["stress_at_low"].values, effects["stress_at_high"].values
    columns = [map(str, effects[key].values) for key in ("source", "low", "high")]
    columns += [map(shown, at_low), map(shown, at_high)]
    rows = [list(row) for row in zip(*columns, strict=True)]
    for family, stress in design.by_family.items():
        rows.append([f"family of the factor: {family}", "", "", shown(stress), ""])
    return ["source", "from", "to", f"{name} at the first", f"{name} at the second"], rows


def _inputs(problem: Problem, sources: Mapping[str, str]) -> list[list[Any]]:
    """Return the constants of a problem by dotted key, with units and sources."""
    # Young's modulus is shown beside the shear modulus, which is stored, with the
    # same source.
    plain = to_plain(problem)
    plain["solid"]["youngs_modulus"] = problem.solid.youngs_modulus
    moduli = "solid.shear_modulus", "solid.youngs_modulus"
    stated = [sources[key] for key in moduli if key in sources]
    sources = dict.fromkeys(moduli, (*stated, "assumed")[0]) | dict(sources)
    inputs = pd.json_normalize(plain).to_dict("records")[0]
    rows: list[list[Any]] = []
    for key, value in inputs.items():
        many = isinstance(value, list) and len(value) > MAX_SHOWN_VALUES
        shown = f"{len(value)} values, mean {np.mean(value):.5g}" if many else value
        unit = UNITS.get(str(key).rpartition(".")[2], "")
        rows.append([key, shown, unit, sources.get(str(key), "assumed")])
    if unknown := [key for key in sources if key not in inputs]:
        raise InputError(
            f"sources: {unknown[0]!r} is not an input of this problem. The inputs are"
            f" {', '.join(map(str, inputs))}"
        )
    return rows
