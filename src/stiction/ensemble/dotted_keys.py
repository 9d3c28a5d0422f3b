"""Dotted keys: a copy of an object with some of its parameters, however deep, replaced."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from stiction.errors import InputError, unknown_name
from stiction.model import describe, keys_of
from stiction.random.marginals import ScipyMarginal


def with_values(owner: Any, values: Mapping[str, Any], path: str = "") -> Any:
    """Return a copy of a model object, or of each of a list, with dotted keys replaced at once.

    Messages begin with `path`, the dotted key of the object itself. It is an `InputError` if a key
    does not exist (the nearest valid one is named) or a value does not fit.
    """
    if isinstance(owner, list):
        return [with_values(one, values, path) for one in owner]
    changes: dict[str, Any] = {}
    inside: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        name, _, rest = key.partition(".")
        if rest:
            inside.setdefault(name, {})[rest] = value
        else:
            changes[name] = value
    if isinstance(owner, ScipyMarginal):
        owner = {"type": owner.type, **dict(owner.parameters)}
    table, begin = isinstance(owner, Mapping), f"{path}." if path else ""
    if not table and not (dataclasses.is_dataclass(owner) and not isinstance(owner, type)):
        raise InputError(f"{path}: has no keys of its own, it is {describe(owner)}")
    names = {} if table else keys_of(type(owner))
    unknown = [name for name in {**changes, **inside} if not table and name not in names]
    if unknown:
        raise InputError([unknown_name(path or "sweep", name, names) for name in unknown])
    for name, below in inside.items():
        part = owner.get(name) if table else getattr(owner, names[name])
        changes[name] = with_values({} if part is None else part, below, begin + name)
    if table:
        return {**owner, **changes}
    try:
        return dataclasses.replace(owner, **{names[key]: one for key, one in changes.items()})
    except InputError as error:
        kind = f"{type(owner).__name__}."
        texts = (text.removeprefix(kind) for text in error.problems)
        raise InputError([begin + text for text in texts]) from None
