"""A fit as a page: parameters, plots, families, and the field for a study file."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

from stiction import __version__
from stiction.ensemble.files import write_whole
from stiction.inference.field_fit import FieldFit, unit_of
from stiction.quantities import UNITS
from stiction.report.page import ShownFigure, render
from stiction.report.tables import Table

CAPTION = (
    "(a) Values and the fitted marginal. (b) Quantiles of the data against those of the fit."
    " (c) Correlation, as the window leaves it. (d) Spectrum; the grey line is the periodogram."
    " (e) Measured over fitted spectrum. Shaded in (a) and (b): 90 % of the fits to records"
    " simulated from the fitted field; in (c), (d) and (e): 90 % of such records themselves."
)


def _parameters(fit: FieldFit) -> Table:
    unit = UNITS[fit.quantity]
    percent = f"{100 * fit.confidence:g} %"
    rows = [
        (name, value, *fit.interval[name], unit_of(name, unit))
        for name, value in fit.parameters.items()
    ]
    columns = ("parameter", "estimate", f"{percent} from", f"{percent} to", "unit")
    return Table.of("parameters", "Parameters", columns, rows)


def _families(fit: FieldFit) -> Table:
    ranked = sorted(fit.families.items(), key=lambda item: -item[1].score)
    rows = [(name, one.score, one.distance) for name, one in ranked]
    columns = ("family", "score", "largest difference of the distribution functions")
    return Table.of("families", "Families of the marginal", columns, rows)


def write_fit(fit: FieldFit, sources: Sequence[str], table: str, folder: Path) -> None:
    """Write page.html, fit.png and field.toml."""
    picture = io.BytesIO()
    fit.plot().savefig(picture, format="png", dpi=140)
    page = render(
        title="A random field from " + ", ".join(Path(source).name for source in sources),
        lead=f"The records hold {fit.lengths_held:.3g} correlation lengths.",
        headline=(),
        points=[
            f"Of records simulated from the fitted field {100 * fit.misfit['marginal']:.3g} % are"
            " as far from their own marginal as these are, and"
            f" {100 * fit.misfit['spectrum']:.3g} % as far from their own spectrum; a few per cent"
            " or less would mean that a family does not suit.",
            "The score of a family is a log likelihood, in correlation lengths, less the number of"
            " parameters, against the best; differences below about 2 mean nothing.",
        ],
        exceptions=[("Doubts", fit.warnings)] if fit.warnings else (),
        key_tables=[_parameters(fit), _families(fit)],
        figures=[
            ShownFigure("fit", "1", "The fit", CAPTION, picture.getvalue(), (), ("fit.png",)),
        ],
        claims=(),
        parameters=(),
        notes=(),
        provenance=[("stiction", __version__)],
        listing=("The field, for a study file (field.toml)", table),
    )
    write_whole(folder / "page.html", page.encode())
    write_whole(folder / "fit.png", picture.getvalue())
    write_whole(folder / "field.toml", table.encode())
