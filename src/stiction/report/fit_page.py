"""A fit as a page: parameters, plots, families, and the field for a study file."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import jinja2

from stiction.ensemble.files import write_whole
from stiction.inference.fit import FieldFit, unit_of
from stiction.quantities import UNITS

CAPTION = (
    "(a) Values and the fitted marginal. (b) Quantiles of the data against those of the fit."
    " (c) Correlation, as the window leaves it. (d) Spectrum; the grey line is the periodogram."
    " (e) Measured over fitted spectrum. Shaded in (a) and (b): 90 % of the fits to records"
    " simulated from the fitted field; in (c), (d) and (e): 90 % of such records themselves."
)


def write_fit(fit: FieldFit, sources: Sequence[str], table: str, folder: Path) -> None:
    """Write page.html, fit.png and field.toml."""
    picture = io.BytesIO()
    fit.plot().savefig(picture, format="png", dpi=140)
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    unit = UNITS[fit.quantity]
    rows = [
        (name, f"{value:.5g}", *(f"{end:.4g}" for end in fit.interval[name]), unit_of(name, unit))
        for name, value in fit.parameters.items()
    ]
    families = sorted(fit.families.items(), key=lambda item: -item[1].score)
    page = environment.get_template("fit.html.j2").render(
        title="A random field from " + ", ".join(Path(source).name for source in sources),
        lead=(
            f"The records hold {fit.lengths_held:.3g} correlation lengths. Of records simulated"
            f" from the fitted field {100 * fit.misfit['marginal']:.3g} % are as far from their own"
            f" marginal as these are, and {100 * fit.misfit['spectrum']:.3g} % as far from their"
            " own spectrum; a few per cent or less would mean that a family does not suit."
        ),
        doubts=fit.warnings,
        confidence=f"{100 * fit.confidence:g} %",
        rows=rows,
        image="data:image/png;base64," + base64.b64encode(picture.getvalue()).decode("ascii"),
        caption=CAPTION,
        families=[(n, f"{one.score:.2f}", f"{one.distance:.3f}") for n, one in families],
        table=table,
    )
    write_whole(folder / "page.html", page.encode("utf-8"))
    write_whole(folder / "fit.png", picture.getvalue())
    write_whole(folder / "field.toml", table.encode("utf-8"))
