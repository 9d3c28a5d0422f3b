"""The report: one HTML file that holds everything it shows."""

from __future__ import annotations

import base64
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jinja2

from stiction.report.tables import Table
from stiction.report.text import mathematics

LONGEST = 60
"""Rows of a table that are shown; a longer one is thinned, and the file has them all."""


OF_THE_PAPER = 7
"""Figures up to this number are the paper's own."""


@dataclass(frozen=True)
class ShownFigure:
    """A figure on the page.

    Attributes
    ----------
    name, number, title, caption : str
    png : bytes
    tables : tuple of Table
        The numbers behind it.
    files : tuple of str
        Where it is beside the page.
    """

    name: str
    number: str
    title: str
    caption: str
    png: bytes
    tables: tuple[Table, ...]
    files: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.files:
            place = f"figures/figure-{self.number}-{self.name}"
            object.__setattr__(self, "files", (f"{place}.pdf", f"{place}.png"))

    @property
    def of_the_paper(self) -> bool:
        """Whether the paper has it; what goes beyond is folded."""
        return self.number.isdigit() and int(self.number) <= OF_THE_PAPER

    @property
    def image(self) -> str:
        """The picture as a data URI."""
        return "data:image/png;base64," + base64.b64encode(self.png).decode("ascii")


@dataclass(frozen=True)
class ShownClaim:
    """A claim on the page.

    Attributes
    ----------
    where, says, printed, comment : str
    computed : tuple of str
    verdict : str
    rule : str
        What the verdict follows from.
    again : tuple of str
        A second verdict and what it follows from; empty if there is none.
    """

    where: str
    says: str
    printed: str
    computed: tuple[str, ...]
    verdict: str
    comment: str
    rule: str
    again: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        """The verdict as a word for style sheets."""
        return self.verdict.replace(" ", "-")


def thinned(table: Table) -> tuple[list[list[str]], int]:
    """Rows to show, and one of how many of the table's rows each of them is."""
    cells = table.cells()
    step = -(-len(cells) // LONGEST)
    return cells[::step], step


def exceptions_among(claims: Sequence[ShownClaim]) -> list[tuple[str, int]]:
    """How many of some claims have which verdict, those that hold left out."""
    counts = Counter(claim.verdict for claim in claims)
    return [(verdict, count) for verdict, count in counts.items() if verdict not in _FINE]


_FINE = ("holds", "true by construction")


def render(
    *,
    title: str,
    lead: str,
    headline: Sequence[tuple[str, int]],
    points: Sequence[str],
    exceptions: Sequence[tuple[str, Sequence[str]]],
    key_tables: Sequence[Table],
    figures: Sequence[ShownFigure],
    claims: Sequence[tuple[str, Sequence[ShownClaim]]],
    limits: Table | None = None,
    parameters: Sequence[tuple[str, str]],
    notes: Sequence[str],
    provenance: Sequence[tuple[str, str]],
    listing: tuple[str, str] | None = None,
) -> str:
    """The page as one string of HTML; texts may hold symbols such as tau_cr.

    Parameters
    ----------
    title, lead : str
    headline : sequence of (verdict, count)
    points : sequence of str
        What a busy reader should know.
    exceptions : sequence of (heading, texts)
        What does not hold as it stands.
    key_tables : sequence of Table
        The results in a few tables.
    figures : sequence of ShownFigure
    claims : sequence of (subject, claims)
    limits : Table, optional
        What the words of claims are taken to mean.
    parameters, provenance : sequences of (name, value)
    notes : sequence of str
        On accuracy.
    listing : (heading, text), optional
        A file that belongs to the page, as it is.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("stiction.report", "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["mathematics"] = mathematics
    environment.filters["thinned"] = thinned
    environment.filters["exceptions"] = exceptions_among
    content: dict[str, Any] = {
        "title": title,
        "lead": lead,
        "headline": headline,
        "points": points,
        "exceptions": exceptions,
        "key_tables": key_tables,
        "figures": figures,
        "claims": claims,
        "limits": limits,
        "parameters": parameters,
        "notes": notes,
        "provenance": provenance,
        "listing": listing,
    }
    return environment.get_template("page.html.j2").render(**content)
