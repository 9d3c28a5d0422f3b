"""Dotted keys: a copy of an object with some of its parameters, however deep, replaced."""

import dataclasses
from collections.abc import Mapping
from typing import Any, NamedTuple

from stiction.errors import InputError, unknown_name
from stiction.model import describe, keys_of
from stiction.random.marginals import ScipyMarginal

MAPPINGS = ("correlation", "between")
"""Tables of `RandomInterface` whose keys are names of properties."""


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
    if isinstance(owner, Mapping):
        return {**owner} | {
            name: branch.value
            if isinstance(branch, _Leaf)
            else _replaced(owner.get(name, {}), branch, f"{path}.{name}")
            for name, branch in tree.items()
        }
    if not dataclasses.is_dataclass(owner) or isinstance(owner, type):
        raise InputError(f"{path}: has no keys of its own, it is {describe(owner)}")
    names = keys_of(type(owner))
    unknown = [unknown_name(path or "sweep", name, names) for name in tree if name not in names]
    if unknown:
        raise InputError(unknown)
    changes = {}
    for name, branch in tree.items():
        inner = f"{path}.{name}" if path else name
        field = names[name]
        if isinstance(branch, _Leaf):
            changes[field] = branch.value
        else:
            part = getattr(owner, field)
            part = {} if part is None and name in MAPPINGS else part
            changes[field] = _replaced(part, branch, inner)
    try:
        return dataclasses.replace(owner, **changes)
    except InputError as error:
        kind = f"{type(owner).__name__}."
        texts = (text.removeprefix(kind) for text in error.problems)
        raise InputError([f"{path}.{text}" if path else text for text in texts]) from None
