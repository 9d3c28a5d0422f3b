"""The paper's figures, one module a figure.

A figure is a module with the names of `registry.Figure`. To add one, write the module and list it
here.
"""

from __future__ import annotations

from collections.abc import Iterable

from stiction._model import describe
from stiction.errors import InputError, unknown_name
from stiction.papers.albertini2020.figures import (
    driving,
    energy,
    fidelity,
    growth,
    interaction,
    mapping,
    mechanism,
    monte_carlo,
    prediction,
    problem,
    rupture,
    sequence,
    size,
    statistics,
    variance,
)
from stiction.papers.albertini2020.registry import Figure, by_name

FIGURES: dict[str, Figure] = by_name(
    problem,
    mapping,
    rupture,
    prediction,
    monte_carlo,
    statistics,
    variance,
    interaction,
    energy,
    growth,
    fidelity,
    driving,
    mechanism,
    size,
    sequence,
)


def select(only: Iterable[str] | None) -> list[Figure]:
    """The figures of these names, in the order of the paper; all of them for None.

    Raises
    ------
    InputError
        Naming every unknown figure and the nearest valid name.
    """
    if only is None:
        return list(FIGURES.values())
    if not isinstance(only, Iterable):
        raise InputError(f"only: must be names of figures, got {describe(only)}")
    names = [only] if isinstance(only, str) else list(only)
    if not names:
        raise InputError(f"only: name at least one figure (valid: {', '.join(FIGURES)})")
    problems = [unknown_name("only", str(name), FIGURES) for name in names if name not in FIGURES]
    if problems:
        raise InputError(problems)
    return [figure for name, figure in FIGURES.items() if name in names]
