"""Errors and warnings: invalid input, and failures of a run."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from difflib import get_close_matches
from typing import Any, NamedTuple

_SYMBOLS = {"E": "youngs_modulus", "nu": "poisson_ratio", "rho": "density"}
_OURS = (
    "stiction", "pydantic", "dataclasses", "functools", "concurrent", "threading", "contextlib"
)  # fmt: skip
LISTED = 5
"""Number of samples that a warning lists at most."""
_FIGURES = r"[-+]?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?"
_NUMBER = re.compile(rf"(?<![\w.]){_FIGURES}(?: to {_FIGURES})?")
"""Numbers and ranges in a warning."""


class InputError(ValueError):
    """Invalid input: a single message that lists every problem.

    Parameters
    ----------
    problems : str or iterable of str
        A message for each mistake, with the key or argument, the given
        value and the valid values.

    Attributes
    ----------
    problems : tuple of str
        The same messages.

    Examples
    --------
    >>> print(InputError(["width: missing", "nodes: must be positive, got -3"]))
    width: missing
    nodes: must be positive, got -3
    >>> InputError("width: missing").problems
    ('width: missing',)

    An error of a worker process keeps its messages:

    >>> import pickle
    >>> pickle.loads(pickle.dumps(InputError(["a", "b"]))).problems
    ('a', 'b')
    """

    def __init__(self, problems: str | Iterable[str]) -> None:
        self.problems = (problems,) if isinstance(problems, str) else tuple(problems)
        super().__init__("\n".join(self.problems))

    def __reduce__(self) -> tuple[type[InputError], tuple[tuple[str, ...]]]:
        return type(self), (self.problems,)


def printable(text: str) -> str:
    r"""Return text with escapes for all characters that could control a terminal.

    >>> printable("a\tb \x1b[2J é \x7f\n")
    'a\tb \\x1b[2J é \\x7f\n'
    """
    return "".join(
        char if char.isprintable() or char in "\n\t" else repr(char)[1:-1] for char in text
    )


class AccuracyWarning(UserWarning):
    """Warning: a valid result is less accurate than it could be.

    The message gives the error.
    """


class UnitWarning(UserWarning):
    """Warning: no solid has such a value, which is probably not in the assumed unit."""


class RunError(RuntimeError):
    """Error: a run cannot continue.

    Stored results are kept, and the message gives the remedy.
    """


class StoreError(RunError):
    """Error: a folder or file cannot be used or written."""


class WorkerError(RunError):
    """Error: workers died or could not be reached."""


def unknown(given: str, valid: Iterable[str]) -> str:
    """Return a message that refuses a name and suggests the nearest valid name.

    Names with over 60 letters are cut.

    >>> unknown("strengthh", ["mean", "strength"])
    "unknown 'strengthh'; did you mean 'strength'? (valid: mean, strength)"
    >>> unknown("q" * 60, ["mean"]).count("q"), unknown("q" * 61, ["mean"]).count("q")
    (60, 57)
    >>> unknown("q" * 61, ["mean"])[-21:]
    "qqq'... (valid: mean)"
    """
    names = list(valid)
    shown = repr(given) if len(given) <= 60 else f"{given[:57]!r}..."
    near = nearest(given, names)
    hint = f"; did you mean {near!r}?" if near else ""
    return f"unknown {shown}{hint} (valid: {', '.join(names)})"


def nearest(given: str, valid: Sequence[str]) -> str:
    """Return the valid name that is similar to a given name, or has it as a word, or ''.

    Seven of ten letters must agree. The case is ignored.

    >>> nearest("abcdefgxyz", ["mean", "abcdefghij"]), nearest("abcdefwxyz", ["abcdefghij"])
    ('abcdefghij', '')
    >>> nearest("STRENGTHH", ["Mean", "Strength"]), nearest("nx", ["mean", "Nx", "nX"])
    ('Strength', 'Nx')

    A single word of a longer name is recognised, and symbols:

    >>> nearest("Ratio", ["mean", "residual_ratio"]), nearest("rat", ["residual_ratio"])
    ('residual_ratio', '')
    >>> [nearest(symbol, ["mean"]) for symbol in ("E", "nu", "rho", "k")]
    ['youngs_modulus', 'poisson_ratio', 'density', '']
    """
    by_case = {name.lower(): name for name in reversed(valid)}
    near = get_close_matches(given.lower(), by_case, n=1, cutoff=0.7)
    near = near or [name for name in by_case if given.lower() in name.split("_")]
    return by_case[near[0]] if near else _SYMBOLS.get(given, "")


def unknown_name(what: str, given: str, valid: Iterable[str]) -> str:
    """Return the message of `unknown`, preceded by the kind of the name.

    >>> unknown_name("type", "bnad", ["band"])
    "type: unknown 'bnad'; did you mean 'band'? (valid: band)"
    """
    return f"{what}: {unknown(given, valid)}"


@contextmanager
def prefixed(name: str, mark: str = ": ") -> Iterator[None]:
    """Put a name before all mistakes that are found inside the context.

    >>> with prefixed("random"), prefixed("[1]", "."):
    ...     raise InputError(["mean: missing", "low: missing"])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: random: [1].mean: missing
    random: [1].low: missing
    """
    try:
        yield
    except InputError as error:
        raise InputError([f"{name}{mark}{text}" for text in error.problems]) from None


def warn_accuracy(message: str) -> None:
    """Issue an `AccuracyWarning` that points at the caller's own line, outside this package.

    >>> with collect_warnings() as caught:
    ...     warn_accuracy("few nodes")
    >>> caught[0].text, caught[0].category.__name__
    ('few nodes', 'AccuracyWarning')
    """
    warn_user(message, AccuracyWarning)


class Warned(NamedTuple):
    """A collected warning, which concerns samples if its `total` is above zero.

    >>> warned = Warned("{samples} err by {worst}", UserWarning, 40, 7, (1, 4, 6), 0.25)
    >>> print(warned)
    7 of 40 samples (1, 4, 6, ...) err by 0.25
    >>> print(warned._replace(affected=3))
    3 of 40 samples (1, 4, 6) err by 0.25
    >>> print(warned.after(20).unnumbered())
    7 of 40 samples err by 0.25
    >>> print(Warned("{plain}", UserWarning))
    {plain}
    """

    text: str  # with {samples} and {worst} if it concerns samples
    category: type[Warning]
    total: int = 0
    affected: int = 0
    numbers: tuple[int, ...] = ()  # of the first of these, if samples have numbers
    worst: float = 0.0

    def __str__(self) -> str:
        if not self.total:
            return self.text
        which = ", ".join(map(str, self.numbers))
        which += ", ..." * (self.affected > len(self.numbers))
        shown = f"{self.affected} of {self.total} samples" + f" ({which})" * bool(self.numbers)
        return self.text.format(samples=shown, worst=self.worst)

    def after(self, first: int) -> Warned:
        """Return the warning with its samples numbered from `first`.

        >>> Warned("", UserWarning, 9, 2, (1, 4)).after(20).numbers
        (21, 24)
        """
        return self._replace(numbers=tuple(first + number for number in self.numbers))

    def unnumbered(self) -> Warned:
        """Return the warning without numbers of samples, which are valid only within a part."""
        return self._replace(numbers=())


_collected: ContextVar[list[Warned] | None] = ContextVar("collected", default=None)


@contextmanager
def collect_warnings() -> Iterator[list[Warned]]:
    """Collect the package's warnings in this thread, and in threads that run in its context.

    `warnings.catch_warnings` changes the whole process, so two threads
    would catch each other's warnings.

    An inner collection takes its warnings away from the outer collection.

    >>> with collect_warnings() as outer:
    ...     warn_accuracy("a")
    ...     with collect_warnings() as inner:
    ...         warn_accuracy("b")
    ...     warn_accuracy("c")
    >>> [[warned.text for warned in caught] for caught in (outer, inner)]
    [['a', 'c'], ['b']]
    """
    warned: list[Warned] = []
    token = _collected.set(warned)
    try:
        yield warned
    finally:
        _collected.reset(token)


@contextmanager
def merge_warnings() -> Iterator[list[Warned]]:
    """Collect warnings. At the end, issue a single warning for each doubt.

    The merged warnings are issued even if the work fails.

    >>> from contextlib import suppress
    >>> with collect_warnings() as outer, suppress(KeyError), merge_warnings() as inner:
    ...     warn_accuracy("few nodes: 7")
    ...     warn_accuracy("few nodes: 5")
    ...     raise KeyError
    >>> [warned.text for warned in outer], len(inner)
    (['few nodes: 5 to 7'], 2)
    """
    caught: list[Warned] = []
    try:
        with collect_warnings() as caught:
            yield caught
    finally:
        for warning in merged(caught):
            issue(warning)


def merged(caught: Iterable[Warned]) -> list[Warned]:
    """Return warnings without repetition.

    Messages that differ only in numbers become a single message with
    ranges. Warnings about samples become a single warning that counts
    all samples.

    Texts about samples may contain numbers, and are equal or differ.

    >>> kind = AccuracyWarning
    >>> caught = [Warned("{samples} of 3", kind, 40, 3, (9, 3, 5), 0.5), Warned("2 m", kind)]
    >>> caught += [Warned("{samples} of 3", kind, 20, 4, (1, 3, 7, 8), 0.7), Warned("5 m", kind)]
    >>> caught += [Warned("{samples} of 4", kind, 20), Warned("2 m", UnitWarning)]
    >>> for warned in merged(caught):
    ...     print(warned.text, warned.category.__name__, *warned[2:])
    {samples} of 3 AccuracyWarning 60 7 (1, 3, 5, 7, 8) 0.7
    2 to 5 m AccuracyWarning 0 0 () 0.0
    {samples} of 4 AccuracyWarning 20 0 () 0.0
    2 m UnitWarning 0 0 () 0.0
    >>> len(merged([Warned("h2", kind), Warned("h3", kind)]))  # no numbers, but names
    2
    """
    groups: dict[tuple[str, type[Warning], bool], list[Warned]] = {}
    for warning in caught:
        key = warning.text if warning.total else _NUMBER.sub("0", warning.text)
        groups.setdefault((key, warning.category, warning.total > 0), []).append(warning)
    return [
        Warned(
            group[0].text if of_samples else _with_ranges([warning.text for warning in group]),
            category,
            sum(warning.total for warning in group),
            sum(warning.affected for warning in group),
            tuple(sorted({number for warning in group for number in warning.numbers})[:LISTED]),
            max(warning.worst for warning in group),
        )
        for (_, category, of_samples), group in groups.items()
    ]


def texts_of(caught: Iterable[Warned]) -> list[str]:
    """Return the messages of collected warnings, without repetition.

    A warning that concerns no sample is left out.

    >>> with collect_warnings() as caught:
    ...     warn_of_samples("{samples} fail", [False, False])
    ...     warn_of_samples("{samples} drift", [False, True])
    ...     warn_accuracy("few nodes")
    >>> texts_of(caught)
    ['1 of 2 samples (1) drift', 'few nodes']
    """
    return [str(one) for one in merged(caught) if one.affected or not one.total]


def _with_ranges(texts: Sequence[str]) -> str:
    """Merge messages that differ only in numbers: '3 to 5 m' for '3 m' and '5 m'.

    The ends are sorted as numbers, and numbers within words are kept.

    >>> _with_ranges(["h2: 1,200 Pa at 2 to 4 m, 3 s", "h2: 900 Pa at 3 m, 3 s"])
    'h2: 900 to 1,200 Pa at 2 to 4 m, 3 s'
    >>> _with_ranges(["-2 m.", "1.5e1 m.", "-10 m."])
    '-10 to 1.5e1 m.'
    """
    between, text = _NUMBER.split(texts[0]), ""
    for start, *numbers in zip(between, *map(_NUMBER.findall, texts), strict=False):
        ends = sorted(
            {end for number in numbers for end in number.split(" to ")},
            key=lambda end: float(end.replace(",", "")),
        )
        same = len({*numbers}) == 1
        text += start + (numbers[0] if same else f"{ends[0]} to {ends[-1]}")
    return text + between[-1]


def warn_of_samples(text: str, which: Any, sizes: Any = ()) -> None:
    r"""Issue an `AccuracyWarning` about some of the samples that were computed together.

    Call it even if it concerns no sample, because all computed samples
    are counted.

    Parameters
    ----------
    text : str
        With ``{samples}`` for '3 of 40 samples (1, 4, 7)' and
        ``{worst}`` for the largest size.
    which : array of bool
        Whether the warning concerns each sample.
    sizes : array, optional
        Error size for each sample.

    Examples
    --------
    >>> with collect_warnings() as caught:
    ...     warn_of_samples("{samples}: {worst}", [False, True, True], [9.0, 0.5, 0.25])
    ...     warn_of_samples("{samples}: {worst}", [True] * 7)
    ...     warn_of_samples("none", [False] * 3, [1.0, 2.0, 3.0])
    >>> print(caught[0], caught[1], caught[2][2:], sep="\n")
    2 of 3 samples (1, 2): 0.5
    7 of 7 samples (0, 1, 2, 3, 4, ...): 0.0
    (3, 0, (), 0.0)
    """
    affected = [bool(flag) for flag in which]
    numbers = [number for number, flag in enumerate(affected) if flag]
    worst = max((float(sizes[number]) for number in numbers if len(sizes)), default=0.0)
    first = tuple(numbers[:LISTED])
    issue(Warned(text, AccuracyWarning, len(affected), len(numbers), first, worst))


def warn_user(message: str, category: type[Warning]) -> None:
    """Issue a warning that points at the caller's own line, outside this package."""
    issue(Warned(message, category))


def issue(warning: Warned) -> None:
    """Issue a warning at the caller's own line, or collect it.

    Frames of this module are skipped, and here doctest is the caller.

    >>> with warnings.catch_warnings(record=True) as shown:
    ...     warnings.simplefilter("always")
    ...     issue(Warned("{samples}", UserWarning, 3, 0))
    ...     warn_of_samples("{samples} fail", [False, True])
    >>> [str(warning.message) for warning in shown]
    ['1 of 2 samples (1) fail']
    >>> shown[0].category.__name__, shown[0].filename.endswith("doctest.py")
    ('AccuracyWarning', True)
    """
    collected = _collected.get()
    if collected is not None:
        collected.append(warning)
        return
    if warning.total and not warning.affected:
        return
    level = 1
    frame = sys._getframe(1)
    # Objects are validated by pydantic, whose frames lie between ours.
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] in _OURS:
        frame, level = frame.f_back, level + 1
    warnings.warn(str(warning), warning.category, stacklevel=level + 1)
