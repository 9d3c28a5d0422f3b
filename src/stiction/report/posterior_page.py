"""One page of what measured peaks tell: the figure, the numbers, the draws as a file."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from stiction import __version__
from stiction.ensemble.files import write_whole
from stiction.inference.posterior import Posterior
from stiction.plot.style import save_figure
from stiction.report.page import ShownFigure, render
from stiction.report.tables import Table

CAPTION = (
    "Each parameter before (grey) and after the tests; above it the information gained, nats."
    " Below, pairs of parameters. On the right, the measured peaks against what the posterior"
    " predicts; bars are the standard deviation of the load cell."
)


def _summary(posterior: Posterior) -> Table:
    rows = []
    for name in posterior.names:
        low, high = posterior.interval(name)
        before = posterior.prior_interval(name)
        rows.append(
            (name, posterior.mean(name), low, high, *before, posterior.information[name],
             posterior.monte_carlo_error[name])
        )  # fmt: skip
    columns = (
        "parameter (SI)", "mean", "5 %", "95 %", "5 % before", "95 % before",
        "information (nats)", "Monte Carlo error / spread",
    )  # fmt: skip
    return Table.of("parameters", "What the peaks tell", columns, rows)


def _draws(posterior: Posterior) -> Table:
    columns = [posterior.draws[name].ravel() for name in posterior.names]
    return Table.of(
        "draws", "Draws from the posterior", posterior.names, zip(*columns, strict=True)
    )


def write_posterior(posterior: Posterior, folder: Path, *, title: str, peaks: Path) -> None:
    """Write report.html, posterior.png and .pdf, parameters.csv and draws.csv into a folder."""
    summary, draws = _summary(posterior), _draws(posterior)
    for table in (summary, draws):
        table.write_csv(folder)
    figure = posterior.plot()
    files = ("posterior.png", "posterior.pdf")
    for name in files:
        save_figure(figure, folder / name)
    image = io.BytesIO()
    figure.savefig(image, format="png", dpi=160)
    least = min(posterior.information, key=lambda name: posterior.information[name])
    model = posterior.likelihood.model
    total = posterior.total_information
    page = render(
        title=title,
        lead=f"{posterior.peaks} from {peaks.name}; onset by {posterior.method}, posterior by"
        f" {posterior.sampler}.",
        headline=(),
        points=[
            f"The tests tell least of {least}: {posterior.information[least]:.2f} nats, where 0.69"
            " would halve a uniform range.",
            *([f"All parameters together: {total:.2f} nats."] if np.isfinite(total) else []),
        ],
        exceptions=(),
        key_tables=[summary],
        figures=[
            ShownFigure("posterior", "1", "Before and after", CAPTION, image.getvalue(), (), files)
        ],
        claims=(),
        parameters=[
            ("load-cell error", f"{model.error:g} {'' if posterior.peaks.coefficients else 'Pa'}"),
            ("simulated samples at each point", str(model.specimens[0].table.peaks.shape[1])),
        ],
        notes=posterior.notes,
        provenance=[("stiction", __version__), ("seed", str(posterior.seed))],
    )
    write_whole(folder / "report.html", page.encode())
