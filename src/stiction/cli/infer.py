"""The command that asks what measured peaks tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from stiction.cli.common import StudyFile, echo, writable_folder
from stiction.errors import InputError


def infer(
    study: StudyFile,
    peaks: Annotated[
        Path,
        typer.Option(
            help="Table of peaks, one test a line, with a heading: 'peak [MPa]', and where there"
            " are any 'length [mm]' of the specimen and 'position [mm]' where slip began."
        ),
    ],
    unit: Annotated[
        str | None,
        typer.Option(help="Of the peaks, where the file states none.", show_default=False),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the page, figure and draws.")] = Path(
        "stiction-inference"
    ),
) -> None:
    """What peaks of repeated tests tell of the parameters of a study.

    Problem, random interface and method come from the study file, the prior and the error of the
    load cell (in Pa, or of a coefficient) from its table [inference]. Prints intervals and
    information, and writes a page, its figure (PNG and PDF) and the draws (CSV) into a folder.
    """
    from stiction.inference.infer import infer as run
    from stiction.inference.peaks import read_peaks
    from stiction.report.posterior_page import write_posterior
    from stiction.study.study import Study

    loaded = Study.from_toml(study)
    given = loaded.inference
    if given is None:
        raise InputError(
            f"inference: {study} has no table [inference]; write what is not known into it, such"
            " as\n  [inference.prior]\n  correlation_length = {low = 1e-3, high = 1e-2, spacing ="
            ' "log"}'
        )
    if loaded.sweep:
        raise InputError(
            f"sweep: `stiction infer` takes one interface; take [[sweep]] out of {study}"
        )
    measured = read_peaks(peaks, unit=unit)
    folder = writable_folder(out)
    posterior = run(
        loaded.problem,
        loaded.random,
        measured,
        prior=given.prior,
        method=loaded.method,
        load_cell_error=given.load_cell_error,
        sampler=given.sampler,
        samples=given.samples,
        seed=loaded.ensemble.seed,
    )
    echo(posterior)
    write_posterior(posterior, folder, title=loaded.title or "What the tests tell", peaks=peaks)
    echo(f"written to {folder}")
