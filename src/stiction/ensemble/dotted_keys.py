"""Dotted keys: a copy of an object with some of its parameters, however deep, replaced."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

from stiction.errors import InputError, unknown_name
from stiction.model import describe
from stiction.random.marginals import ScipyMarginal
from stiction.random.random_interface import RandomInterface

CORRELATION = "correlation"
"""Table of `RandomInterface` whose keys are names of properties, and its values pure numbers."""


def with_values(owner: Any, values: Mapping[str, Any]) -> Any:
    """Return a copy of a model object with dotted keys replaced, all of them at once.

    Raises
    ------
    InputError
        If a key does not exist (the nearest valid one is named) or a value does not fit.
    """
    tree: dict[str, Any] = {}
    for key, value in values.items():
        *folders, last = key.split(".")
        table = tree
        for name in folders:
            table = table.setdefault(name, {})
        table[last] = _Leaf(value)
    return _replaced(owner, tree, "")


class _Leaf(NamedTuple):
    value: Any


def _replaced(owner: Any, tree: Mapping[str, Any], path: str) -> Any:
    if isinstance(owner, ScipyMarginal):
        changes = {name: leaf.value for name, leaf in tree.items() if isinstance(leaf, _Leaf)}
        return {"type": owner.type, **dict(owner.parameters), **changes}
    if not dataclasses.is_dataclass(owner):
        raise InputError(f"{path}: has no keys of its own, it is {describe(owner)}")
    names = [field.name for field in dataclasses.fields(owner) if field.init]
    unknown = [unknown_name(path or "sweep", name, names) for name in tree if name not in names]
    if unknown:
        raise InputError(unknown)
    changes = {}
    for name, branch in tree.items():
        inner = f"{path}.{name}" if path else name
        if isinstance(branch, _Leaf):
            changes[name] = branch.value
        elif name == CORRELATION and isinstance(owner, RandomInterface):
            changes[name] = _joined(owner.correlation or {}, branch)
        else:
            changes[name] = _replaced(getattr(owner, name), branch, inner)
    try:
        return dataclasses.replace(owner, **changes)
    except InputError as error:
        kind = f"{type(owner).__name__}."
        texts = (text.removeprefix(kind) for text in error.problems)
        raise InputError([f"{path}.{text}" if path else text for text in texts]) from None


def _joined(owner: Mapping[str, Any], tree: Mapping[str, Any]) -> dict[str, Any]:
    """A nested mapping with the leaves of the tree put into it."""
    result = dict(owner)
    for name, branch in tree.items():
        leaf = isinstance(branch, _Leaf)
        result[name] = branch.value if leaf else _joined(result.get(name, {}), branch)
    return result
