"""The paper from end to end: studies, figures, tables, claims, report."""

from __future__ import annotations

import dataclasses
import io
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import xarray as xr

from stiction._checks import check_flag, check_instance, check_progress
from stiction._files import write_atomically
from stiction._model import describe
from stiction._progress import Meter
from stiction.errors import InputError
from stiction.papers.albertini2020 import studies
from stiction.papers.albertini2020.claims import CLAIMS, Claim, judged
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.figures import select
from stiction.papers.albertini2020.registry import Figure
from stiction.papers.albertini2020.results import write_results
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.summary import assemble, claims_table
from stiction.plot.style import paper_style
from stiction.report.page import ShownFigure

SAMPLES = 10_000
QUICK = 500
FEWEST = 64
RUNS = 20
"""Ruptures at each correlation length, as in the paper."""
_FEW = 2
_FEWEST_DYNAMIC = 16
_LARGEST = 2**63  # that a file can hold
_DRAWING = 10_000  # work of a figure, for progress


def run(
    out: str | Path,
    samples: int | None = None,
    seed: int = 0,
    quick: bool = False,
    full: bool = False,
    ruptures: int | None = None,
    workers: int | None = None,
    only: Iterable[str] | None = None,
    progress: bool | Callable[[int, int], None] = False,
    setting: Setting | None = None,
) -> Path:
    """Compute the paper's statistics, draw its figures, judge its claims and write a report.

    Parameters
    ----------
    out : path
        Folder, made if it is not there: `report.html`, `results.nc` (one group a study),
        `figures/*.png` and `*.pdf`, `tables/*.csv`.
    samples : int
        For each correlation length of the Monte Carlo study, at least 64 (10,000 by default, 500
        if `quick`); side studies take a quarter.
    seed : int
        Not negative. The same seed gives the same numbers, whatever the workers.
    quick : bool
        500 samples and two ruptures at each correlation length, unless they are given, for a first
        look.
    full : bool
        Also the Monte Carlo study by elastodynamics: an ensemble of ruptures at every correlation
        length, 0.03 s each on one core: for all 40,000 ten minutes on two.
    ruptures : int, optional
        Ruptures at each correlation length of that ensemble, at least 16 (`samples` by default);
        without `full`, of the comparison with simulations, at least 2 (20 by default).
    workers : int, optional
        Threads; all cores by default.
    only : iterable of str, optional
        Names of figures. Only their studies run, and only the claims that those can judge are
        shown.
    progress : bool or callable
        True shows a bar on a terminal; a callable gets (done, total) in samples.
    setting : Setting, optional
        Other parameters than the paper's; figures and verdicts follow.

    Returns
    -------
    Path
        Of the report.

    Notes
    -----
    Results of each study are kept in the folder. The same call after an interruption computes only
    what is missing; so does a call for other figures.

    Raises
    ------
    InputError
        Naming all that is wrong, unknown figures with the nearest valid name.
    """
    started = time.perf_counter()
    count = (QUICK if quick else SAMPLES) if samples is None else samples
    folder, figures = _checked(
        out, count, seed, quick, full, ruptures, workers, only, progress, setting
    )
    try:
        for name in ("figures", "tables"):
            (folder / name).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"out: {folder} cannot be made: {error.strerror}") from None
    few = _FEW if quick else RUNS
    context = Context(
        setting or Setting(),
        count,
        seed,
        workers,
        ruptures=few if full or ruptures is None else ruptures,
        dynamic=(ruptures or count) if full else 0,
        folder=folder,
    )
    there = studies.offered(context)
    figures = [figure for figure in figures if there.issuperset(figure.needs)]
    claims = list(CLAIMS.values()) if only is None else _claims_of(figures)
    claims = [claim for claim in claims if there.issuperset(claim.needs)]
    needed = studies.with_needs(
        [
            *(n for figure in figures for n in figure.needs),
            *(n for one in claims for n in one.needs),
        ]
    )
    total = studies.cost(needed, context) + _DRAWING * len(figures)
    with Meter("paper", total, progress, unit="steps") as meter:
        context.report = meter.advance
        data, drawn = _compute_and_draw(needed, figures, context, folder)
    shown = [drawn[figure.name] for figure in figures]
    findings = judged(data, claims)
    for table in (table for figure in shown for table in figure.tables):
        table.write_csv(folder / "tables")
    claims_table(findings).write_csv(folder / "tables")
    write_results(folder / "results.nc", data)
    html = assemble(data, shown, findings, context.warnings, time.perf_counter() - started)
    return _write(folder / "report.html", html)


def _checked(
    out: Any,
    samples: Any,
    seed: Any,
    quick: Any,
    full: Any,
    ruptures: Any,
    workers: Any,
    only: Any,
    progress: Any,
    setting: Any,
) -> tuple[Path, list[Figure]]:
    problems: list[str] = []

    def check(test: Callable[..., Any], *given: Any) -> Any:
        try:
            return test(*given)
        except InputError as error:
            problems.extend(error.problems)

    for name, value in (("quick", quick), ("full", full)):
        check(check_flag, name, value)
    check(check_progress, progress)
    if setting is not None:
        check(check_instance, "setting", setting, Setting)
    counts = [("samples", samples, FEWEST), ("seed", seed, 0)]
    if ruptures is not None:
        counts.append(("ruptures", ruptures, _FEWEST_DYNAMIC if full else _FEW))
    if workers is not None:
        counts.append(("workers", workers, 1))
    for name, value, smallest in counts:
        if isinstance(value, bool) or not isinstance(value, int) or value < smallest:
            problems.append(f"{name}: must be a whole number >= {smallest}, got {describe(value)}")
        elif value >= _LARGEST:
            problems.append(f"{name}: must be below 2^63, got {describe(value)}")
    figures: list[Figure] = check(select, only) or []
    if only is not None and not full and any("dynamic" in figure.needs for figure in figures):
        problems.append("only: the Monte Carlo study by elastodynamics needs full")
    folder = check(_folder, out)
    if problems:
        raise InputError(problems)
    return folder, figures


def _folder(out: Any) -> Path:
    """The folder, made."""
    if not isinstance(out, str | os.PathLike) or not str(out):
        raise InputError(f"out: must be the path of a folder, got {describe(out)}")
    folder = Path(out)
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    if not existing.is_dir():
        raise InputError(f"out: {existing} is a file; give a folder")
    if not os.access(existing, os.W_OK):
        raise InputError(f"out: {existing} cannot be written")
    return folder


def _claims_of(figures: list[Figure]) -> list[Claim]:
    """Claims that the studies of these figures can judge; those that need none come with all."""
    there = {need for figure in figures for need in figure.needs}
    return [claim for claim in CLAIMS.values() if claim.needs and there.issuperset(claim.needs)]


def _compute_and_draw(
    needed: set[str], figures: list[Figure], context: Context, folder: Path
) -> tuple[Data, dict[str, ShownFigure]]:
    """The studies, and each figure as soon as those are done that it shows."""
    found: dict[str, xr.Dataset] = {}
    data = Data(context.setting, context.samples, context.seed, found)
    drawn: dict[str, ShownFigure] = {}

    def draw_ready() -> None:
        for figure in figures:
            shows = {*figure.needs, *needed.intersection(getattr(figure, "may_show", ()))}
            if figure.name not in drawn and found.keys() >= shows:
                drawn[figure.name] = _draw(figure, data, folder)
                context.report(_DRAWING)

    for name, dataset in studies.results(needed, context):
        found[name] = dataset
        draw_ready()
    draw_ready()  # what needs no study
    ordered = {name: found[name] for name in studies.STUDIES if name in found}
    return dataclasses.replace(data, studies=ordered), drawn


def _draw(figure: Figure, data: Data, folder: Path) -> ShownFigure:
    path = folder / "figures" / f"figure-{figure.number}-{figure.name}"
    buffer = io.BytesIO()
    with paper_style():
        drawn = figure.draw(data)
        drawn.savefig(buffer, format="png")
        drawn.set_layout_engine("none")  # panels stay where they are
        drawn.savefig(path.with_suffix(".pdf"))
    path.with_suffix(".png").write_bytes(buffer.getvalue())
    return ShownFigure(
        figure.name,
        figure.number,
        figure.title,
        figure.caption(data),
        buffer.getvalue(),
        tuple(figure.tables(data)),
    )


def _write(path: Path, text: str) -> Path:
    """Written aside and renamed, so that a report is whole or not there."""
    write_atomically(path, text.encode())
    return path
