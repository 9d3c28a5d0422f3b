"""The rule for columns: which column of a table is read.

A wrong column gives a wrong number, so a column is never guessed. The
rule is stated in `RULE`. Its steps are:

1. Read a column that the caller names.
2. Give each column a role by the words of its heading (`role_of`). Only
   columns with numbers whose unit fits, or is not stated, can be the
   wanted quantity.
3. Read the column whose heading names the wanted quantity. If no
   heading does, read the only column that is left besides numbers of
   specimens, times and places.
4. Otherwise refuse the choice. The message lists all columns, their
   roles and the argument to add.

`Reading` states what was read. Every reader adds it to its result.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.units import is_in

RULE = (
    "A column is read if its heading, or the caller, says that it is the wanted quantity. If"
    " several columns could be this quantity, none is read"
)
Role = Literal[
    "pressing force", "travel", "time", "friction", "force", "length", "specimen", "other"
]
NAMES: dict[str, Role] = {
    **dict.fromkeys(("n", "fn", "fz", "sigma", "sigman"), "pressing force"),
    **dict.fromkeys(("ff", "ft", "fmax", "\N{GREEK SMALL LETTER MU}"), "friction"),
    **dict.fromkeys(("slipforce", "slipload", "slipfactor", "slipresistance"), "friction"),
    **dict.fromkeys(("x", "xvalue", "slip"), "travel"),
    "t": "time", "f": "force", "#": "specimen",
}  # fmt: skip
"""Whole names, without blanks and marks, by role."""
_WORDS: dict[Role, str] = {
    "pressing force": "normal clamp preload pretension prestress bolt vertical press contact"
    " vorspann klemm spannkraft schraub auflast anpress flächenpress druck serrage précharge"
    " precharge boulon apriete precarga perno tornillo fz fnormal",
    "travel": "travel displacement extension position crosshead stroke distance coordinate lateral"
    " pos weg standardweg hub traverse verschiebung déplacement deplacement course desplazamiento"
    " recorrido posición posicion",
    "time": "time timestamp date datum zeit uhrzeit temps tiempo fecha hora elapsed sekunden",
    "friction": "friction tangential shear peak coefficient coeficiente coeff cof mu tau strength"
    " max maximum reib haft scher schub gleit frottement tangentiel cisaill fricción friccion"
    " rozamiento cortante deslizamiento glissement höchst maximal \N{MICRO SIGN}",
    "force": "force load stress kraft standardkraft prüfkraft last spannung effort charge"
    " contrainte fuerza carga",
    "length": "length länge laenge longueur longitud",
    "specimen": "specimen test sample probe versuch run no nr number id lauf index essai"
    " éprouvette muestra ensayo probeta cycle step",
}
ROLES = {role: tuple(words.split()) for role, words in _WORDS.items()}
"""Beginnings of words in headings, by the roles that they state. A
'shear displacement' is a travel, because roles are tried in this
order."""
_COEFFICIENT = (
    r"\bcof\b|\bmu\b|^[\N{MICRO SIGN}\N{GREEK SMALL LETTER MU}]|coefficient|coeff\b|slip factor"
    r"|reib\w*(?:zahl|wert|koeffizient)|coeficiente"
)
"""Names of friction coefficients."""
ASIDE = ("specimen", "time", "travel", "length")
"""Roles of columns that never compete for a force or a stress."""
MAX_LISTED = 20
"""Number of columns that a message lists at most."""

Wanted = str | int | None


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a table, or a variable in labelled data."""

    name: str  # heading without its unit
    unit: str  # as stated, '' if it is not stated
    values: Any  # NaN in empty cells
    number: int  # from 0
    heading: str = ""
    text: str = ""  # what it holds if it holds no numbers
    cells: Sequence[str] = ()  # the words in such a column

    @property
    def label(self) -> str:
        """The heading, or the number of a column without a heading."""
        return self.heading or self.name

    def may_be_in(self, *units: str) -> bool:
        """Return whether the unit is one of these, or is not stated."""
        return not self.unit or any(is_in(self.unit, si) for si in units)

    def __str__(self) -> str:
        number = f"column {self.number}" if self.number >= 0 else "variable"
        return f"{number} {self.heading!r}" if self.heading else number


class Table(NamedTuple):
    """Columns of a file or a data frame, and what is known about their rows."""

    columns: tuple[Column, ...]
    source: str
    lines: Array  # the number of the line of each row
    headed: bool = True  # whether columns have names
    left_out: tuple[str, ...] = ()  # rows that were not read, and why
    begins: tuple[int, ...] = ()  # lines at which tables begin, if remarks separate several
    mark: str | None = None  # the decimal mark, if a cell has one


class Reading(NamedTuple):
    """Record of what was read: file, column, unit, number of values, and omissions."""

    source: str
    column: str
    unit: str
    values: int
    others: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()

    def __str__(self) -> str:
        parts = [f"{self.column} in {self.unit}, {self.values} values"]
        parts += ["other columns: " + ", ".join(self.others)] * bool(self.others)
        parts += ["left out: " + "; ".join(self.left_out)] * bool(self.left_out)
        return f"{self.source}: " + "; ".join(parts)

    @property
    def attributes(self) -> dict[str, Any]:
        """Return the record as attributes of an array."""
        return {
            "source": self.source, "column": self.column, "unit_in_source": self.unit,
            "values": self.values, "other_columns": ", ".join(self.others),
            "left_out": "; ".join(self.left_out),
        }  # fmt: skip


def is_coefficient_name(column: Column) -> bool:
    """Return whether the heading of a column names a friction coefficient, which has unit 1."""
    name = column.name.casefold()
    return bool(re.search(_COEFFICIENT, name)) and role_of(column) == "friction"


def role_of(column: Column) -> Role:
    """Return the role that the heading of a column states (step 2)."""
    words = re.findall(r"[^\W\d_]+|#", column.name.casefold())
    for name in ("".join(words), "".join(words[:2])):  # also 'slip load at 0.15 mm'
        if name in NAMES:
            return NAMES[name]
    for role, beginnings in ROLES.items():
        if any(_begins(word, part) for word in words for part in beginnings):
            return role
    for role in ("travel", "time", "friction", "force"):  # compounds, such as Prüfkraft
        if any(word.endswith(ROLES[role]) for word in words):
            return role
    return "other"


def _begins(word: str, part: str) -> bool:
    return word == part or (len(part) > 3 and word.startswith(part))


def named(columns: Sequence[Column], names: str) -> list[Column]:
    """Return the columns whose headings begin with one of the names, as a pattern."""
    return [c for c in columns if re.match(names, c.name.strip("_:. ").casefold())]


def read_column(
    columns: Sequence[Column],
    quantity: str,
    argument: str,
    wanted: Wanted,
    units: Iterable[str],
    says: Callable[[Column], bool] = lambda column: role_of(column) == "friction",
) -> Column:
    """Return the column of a quantity by the rule, or refuse the choice (steps 1 to 4)."""
    # 1.
    if wanted is not None:
        return stated_column(columns, argument, wanted)
    # 2.
    numeric = [column for column in columns if not column.text]
    fitting = [column for column in numeric if column.may_be_in(*units)]
    # 3.
    chosen = [column for column in fitting if says(column)]
    if not chosen:
        rivals = [c for c in fitting if role_of(c) not in ASIDE]
        pressing = any(role_of(column) == "pressing force" for column in numeric)
        chosen = [] if pressing or len(rivals) > 1 else rivals
    if len(chosen) == 1:
        return chosen[0]
    # 4.
    raise InputError(unclear(columns, quantity, argument, chosen or fitting))


def unclear(
    columns: Sequence[Column], quantity: str, argument: str, likely: Sequence[Column] = ()
) -> str:
    """Return the message that refuses a choice, with all columns and the argument to add."""
    listed = [f"{c} ({'no numbers' if c.text else role_of(c)})" for c in columns]
    more = f" and {len(listed) - MAX_LISTED} more" * (len(listed) > MAX_LISTED)
    headings = [column.label for column in columns]
    arguments = [
        f"{argument}={c.label!r}" if headings.count(c.label) == 1 else f"{argument}={c.number}"
        for c in likely
    ]
    advice = " or ".join(arguments[:4]) or f"{argument}= with the name or number of a column"
    several = f"{len(likely)} columns could be" if len(likely) > 1 else "no column is clearly"
    return (
        f"{several} the {quantity}. {RULE}. The columns are {', '.join(listed[:MAX_LISTED])}{more}."
        f" Pass {advice}"
    )


def stated_column(columns: Sequence[Column], argument: str, wanted: str | int) -> Column:
    """Return the column that the caller named by its heading, name or number (step 1)."""
    fitting = [c for c in columns if wanted in (c.heading, c.name) and wanted != ""]
    if not fitting:
        fitting = [c for c in columns if wanted == c.number]
    if not fitting:
        raise InputError(unknown_name(argument, str(wanted), [c.label for c in columns]))
    if len(fitting) > 1:
        numbers = " and ".join(str(column.number) for column in fitting)
        raise InputError(
            f"columns {numbers} are {'both' if len(fitting) == 2 else 'all'} called {wanted!r}."
            f" Choose a column by its number, for example {argument}={fitting[-1].number}"
        )
    if fitting[0].text:
        raise InputError(fitting[0].text)
    return fitting[0]


def reading_of(table: Table, column: Column, unit: str, used: dict[str, Column]) -> Reading:
    """Return the record for a table.

    `used` holds further columns that were read, by role.
    """
    known = {id(other): what for what, other in used.items()}
    others = tuple(
        f"{other.label!r}"
        + (f" ({known[id(other)]})" if id(other) in known else f" ({role_of(other)}, not read)")
        for other in table.columns
        if other is not column and other.label
    )
    stated = column.unit or f"{unit}, which is assumed"
    count = int(np.isfinite(column.values).sum())
    return Reading(table.source, str(column), stated, count, others, table.left_out)
