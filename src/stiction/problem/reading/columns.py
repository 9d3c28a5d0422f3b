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
        """The heading, or the number of a column without a heading.

        >>> Column("F", "kN", None, 3, "F (kN)").label, Column("3", "", None, 3).label
        ('F (kN)', '3')
        """
        return self.heading or self.name

    def may_be_in(self, *units: str) -> bool:
        """Return whether the unit is one of these, or is not stated.

        >>> force, unknown = Column("F", "kN", None, 0), Column("F", "", None, 0)
        >>> force.may_be_in("Pa", "N"), force.may_be_in("Pa"), unknown.may_be_in("Pa")
        (True, False, True)
        """
        return not self.unit or any(is_in(self.unit, si) for si in units)

    def __str__(self) -> str:
        """Return the number, if it is a column of a table, and the heading.

        >>> [str(Column("F", "kN", None, *rest)) for rest in ((0, "F (kN)"), (-1, "F"), (4,))]
        ["column 0 'F (kN)'", "variable 'F'", 'column 4']
        """
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
        """Return the record in a line.

        >>> print(Reading("a.csv", "column 1", "kN", 7, left_out=("line 3",)))
        a.csv: column 1 in kN, 7 values; left out: line 3
        >>> print(Reading("a.csv", "column 1", "kN", 7, ("'x'", "'t'"), ("line 3", "line 9")))
        a.csv: column 1 in kN, 7 values; other columns: 'x', 't'; left out: line 3; line 9
        """
        parts = [f"{self.column} in {self.unit}, {self.values} values"]
        parts += ["other columns: " + ", ".join(self.others)] * bool(self.others)
        parts += ["left out: " + "; ".join(self.left_out)] * bool(self.left_out)
        return f"{self.source}: " + "; ".join(parts)

    @property
    def attributes(self) -> dict[str, Any]:
        """Return the record as attributes of an array.

        >>> record = Reading("a.csv", "column 1", "kN", 7, ("'x'", "'t'"), ("line 3", "line 9"))
        >>> [*record.attributes.values()]
        ['a.csv', 'column 1', 'kN', 7, "'x', 't'", 'line 3; line 9']
        """
        return {
            "source": self.source, "column": self.column, "unit_in_source": self.unit,
            "values": self.values, "other_columns": ", ".join(self.others),
            "left_out": "; ".join(self.left_out),
        }  # fmt: skip


def is_coefficient_name(column: Column) -> bool:
    """Return whether the heading of a column names a friction coefficient, which has unit 1.

    A force, or a coefficient whose role is a force or a travel, does not count:

    >>> names = "COF", "peak mu", "Reibzahl", "slip factor", "Shear Coeff.", chr(956) + "_max"
    >>> [is_coefficient_name(Column(name, "", None, 0)) for name in names]
    [True, True, True, True, True, True]
    >>> names = "friction force", "coefficient of travel", "mu normal", "mud", "coffee"
    >>> [is_coefficient_name(Column(name, "", None, 0)) for name in names]
    [False, False, False, False, False]
    """
    name = column.name.casefold()
    return bool(re.search(_COEFFICIENT, name)) and role_of(column) == "friction"


def role_of(column: Column) -> Role:
    """Return the role that the heading of a column states (step 2).

    >>> def roles(*names):
    ...     return [role_of(Column(name, "", None, 0)) for name in names]
    >>> roles("F_N", "Slip load at 0.15 mm", "t2", "F", "#", "x value", "FT")
    ['pressing force', 'friction', 'time', 'force', 'specimen', 'travel', 'friction']

    The roles are tried in the order of `ROLES`. Short words must be whole:

    >>> roles("Normal load", "shear displacement", "elapsed runs", "Max. load", "test force")
    ['pressing force', 'travel', 'time', 'friction', 'force']
    >>> roles("gauge length", "runs", "run 2", "posture", "pos. 2", "Bolts")
    ['length', 'other', 'specimen', 'other', 'travel', 'pressing force']

    The last word of a compound counts if its beginning is unknown:

    >>> roles("Maschinenweg", "Ortszeit", "Gesamtreibung", "Haltekraft", "Nummernlauf")
    ['travel', 'time', 'other', 'force', 'other']
    """
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
    """Return whether a word is a part or, for parts above three letters, begins with it.

    >>> _begins("bolts", "bolt"), _begins("hubs", "hub"), _begins("hub", "hub")
    (True, False, True)
    """
    return word == part or (len(part) > 3 and word.startswith(part))


def named(columns: Sequence[Column], names: str) -> list[Column]:
    """Return the columns whose headings begin with one of the names, as a pattern.

    >>> names = "_Time", "real time", "t", "tau"
    >>> columns = [Column(name, "", None, number) for number, name in enumerate(names)]
    >>> [column.number for column in named(columns, "time|t$")]
    [0, 2]
    """
    return [c for c in columns if re.match(names, c.name.strip("_:. ").casefold())]


def read_column(
    columns: Sequence[Column],
    quantity: str,
    argument: str,
    wanted: Wanted,
    units: Iterable[str],
    says: Callable[[Column], bool] = lambda column: role_of(column) == "friction",
) -> Column:
    """Return the column of a quantity by the rule, or refuse the choice (steps 1 to 4).

    >>> def column(number, name, unit):
    ...     return Column(name, unit, np.zeros(2), number, name, "no number" * (name == "note"))
    >>> named = zip(("x", "note", "load", "clamp load", "FT"), ("mm", "", "kN", "kN", ""))
    >>> columns = [column(number, *pair) for number, pair in enumerate(named)]
    >>> def read(*numbers, wanted=None):
    ...     some = [columns[number] for number in numbers]
    ...     try:
    ...         return str(read_column(some, "peak force", "force", wanted, ["Pa", "N"]))
    ...     except InputError as error:
    ...         return str(error).partition(".")[0] + "..." + str(error).rpartition(".")[2]
    >>> read(0, 1, 2), read(0, 1, 2, 3, 4), read(0, 1, 2, wanted="x")
    ("column 2 'load'", "column 4 'FT'", "column 0 'x'")

    Two friction forces compete. A pressing force leaves no other force
    without doubt:

    >>> columns += [column(5, "shear force", "N"), column(6, "stress", "Pa")]
    >>> read(0, 4, 2, 5)
    "2 columns could be the peak force... Pass force='FT' or force='shear force'"
    >>> read(2, 3)[36:], read(2, 6, 1)[:33]
    (" Pass force='load' or force='clamp load'", '2 columns could be the peak force')
    >>> read(3)[:20], read(0, 1)[39:]
    ('no column is clearly', 'Pass force= with the name or number of a column')

    Times and columns in another unit are no rivals. Columns with words
    cannot be chosen:

    >>> columns += [column(7, "slip resistance", "mm"), column(8, "t", "")]
    >>> read(2, 7, 8), read(1, 2, wanted="note")
    ("column 2 'load'", 'no number...no number')
    """
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
    """Return the message that refuses a choice, with all columns and the argument to add.

    >>> load, note = Column("F", "N", None, 0, "F (N)"), Column("9", "", None, 9, "", "no")
    >>> message = unclear([load, note], "strength", "value", [load, note])
    >>> message.removeprefix(f"2 columns could be the strength. {RULE}. The columns are ")
    "column 0 'F (N)' (force), column 9 (no numbers). Pass value='F (N)' or value='9'"

    Columns with equal headings are told by their numbers. At most 20
    columns are listed, and four advised:

    >>> columns = [Column("F", "N", None, number, "F") for number in range(22)]
    >>> unclear(columns, "strength", "value", columns).partition("column 19 ")[2]
    "'F' (force) and 2 more. Pass value=0 or value=1 or value=2 or value=3"
    >>> unclear(columns[:20], "strength", "value", columns[:1])[-35:]
    "column 19 'F' (force). Pass value=0"
    """
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
    """Return the column that the caller named by its heading, name or number (step 1).

    A heading or a name precedes a number:

    >>> columns = [Column("F", "kN", None, 0, "F (kN)"), Column("F", "N", None, 1, "F (N)")]
    >>> columns += [Column("1", "", None, 2, "1"), *[Column("", "", None, n) for n in (3, 4)]]
    >>> [stated_column(columns, "x", wanted).number for wanted in ("F (N)", "1", 1, 3)]
    [1, 2, 1, 3]
    >>> stated_column(columns[2:], "x", 3).number
    3
    >>> for wanted in ("F", ""):
    ...     try:
    ...         stated_column(columns, "x", wanted)
    ...     except InputError as error:
    ...         print(str(error)[:83])
    columns 0 and 1 are both called 'F'. Choose a column by its number, for example x=1
    x: unknown '' (valid: F (kN), F (N), 1, , )
    """
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

    >>> x, F = Column("x", "mm", np.zeros(3), 0, "x (mm)"), Column("F", "", np.zeros(3), 1, "F")
    >>> F.values[1:] = np.nan, np.inf
    >>> columns = x, F, Column("t", "s", np.zeros(3), 2)
    >>> table = Table(columns, "a.csv", np.arange(3), left_out=("line 9",))
    >>> reading_of(table, F, "N", {"x": x})[1:5]
    ("column 1 'F'", 'N, which is assumed', 1, ("'x (mm)' (x)", "'t' (time, not read)"))
    >>> read = reading_of(table, x, "m", {})
    >>> read.source, read[1:4], read.others[0], read.left_out
    ('a.csv', ("column 0 'x (mm)'", 'mm', 3), "'F' (force, not read)", ('line 9',))
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
