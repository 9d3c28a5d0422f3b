"""The report: one HTML file that holds everything it shows."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jinja2

from stiction.report.tables import Table
from stiction.report.text import mathematics

LONGEST = 60
"""Rows of a table that are shown; a longer one is thinned, and the file has them all."""


@dataclass(frozen=True)
class ShownFigure:
    """A figure on the page.

    Attributes
    ----------
    name, number, title, caption : str
    png : bytes
    tables : tuple of Table
        The numbers behind it.
    """

    name: str
    number: str
    title: str
    caption: str
    png: bytes
    tables: tuple[Table, ...]

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
    """

    where: str
    says: str
    printed: str
    computed: tuple[str, ...]
    verdict: str
    comment: str

    @property
    def kind(self) -> str:
        """The verdict as a word for style sheets."""
        return self.verdict.replace(" ", "-")


def thinned(table: Table) -> tuple[list[list[str]], int]:
    """Rows to show, and one of how many of the table's rows each of them is."""
    cells = table.cells()
    step = -(-len(cells) // LONGEST)
    return cells[::step], step


def render(
    *,
    title: str,
    lead: str,
    headline: Sequence[tuple[str, int]],
    points: Sequence[str],
    exceptions: Sequence[tuple[str, Sequence[str]]],
    key_table: Table | None,
    figures: Sequence[ShownFigure],
    claims: Sequence[tuple[str, Sequence[ShownClaim]]],
    parameters: Sequence[tuple[str, str]],
    notes: Sequence[str],
    provenance: Sequence[tuple[str, str]],
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
    key_table : Table, optional
        The results in one table.
    figures : sequence of ShownFigure
    claims : sequence of (subject, claims)
    parameters, provenance : sequences of (name, value)
    notes : sequence of str
        On accuracy.
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
    content: dict[str, Any] = {
        "title": title,
        "lead": lead,
        "headline": headline,
        "points": points,
        "exceptions": exceptions,
        "key_table": key_table,
        "figures": figures,
        "claims": claims,
        "parameters": parameters,
        "notes": notes,
        "provenance": provenance,
    }
    return environment.get_template("page.html.j2").render(**content)
