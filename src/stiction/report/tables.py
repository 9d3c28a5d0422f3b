"""A table: once for the page, once as a file."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stiction.ensemble.files import write_whole


@dataclass(frozen=True)
class Table:
    """Rows of numbers and texts under named columns.

    Attributes
    ----------
    name : str
        File name without ending.
    title : str
    columns : tuple of str
        With units.
    rows : tuple of tuples
    """

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    @classmethod
    def of(
        cls, name: str, title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]
    ) -> Table:
        """From any sequences; every row must have one entry for each column."""
        fixed = tuple(tuple(row) for row in rows)
        wrong = [row for row in fixed if len(row) != len(columns)]
        if wrong:
            raise ValueError(f"table {name}: {len(columns)} columns, but a row is {wrong[0]!r}")
        return cls(name, title, tuple(columns), fixed)

    def write_csv(self, folder: Path) -> Path:
        """Write full precision to folder/name.csv, whole or not at all."""
        path = folder / f"{self.name}.csv"
        text = io.StringIO(newline="")
        writer = csv.writer(text)
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        write_whole(path, text.getvalue().encode())
        return path

    def cells(self) -> list[list[str]]:
        """Entries as they are shown, numbers to five digits."""
        return [[shown(entry) for entry in row] for row in self.rows]


def shown(entry: Any) -> str:
    """A table entry as text: numbers to five digits, without exponents where they fit."""
    if entry is None:
        return "\N{EN DASH}"
    if isinstance(entry, bool | np.bool_):
        return "yes" if entry else "no"
    if isinstance(entry, int | np.integer):
        return f"{entry:,}"
    if isinstance(entry, float | np.floating):
        if np.isnan(entry):
            return "\N{EN DASH}"
        text = f"{entry:.5g}"
        return text.replace("-", "\N{MINUS SIGN}")
    return str(entry)
