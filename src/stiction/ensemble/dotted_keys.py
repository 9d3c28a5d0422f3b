"""Dotted keys: a copy of an object with some of its parameters, however deep, replaced."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from stiction.errors import InputError, unknown_name
from stiction.model import describe, keys_of
from stiction.random.marginals import ScipyMarginal

MAPPINGS = ("correlation", "between")
"""Tables of `RandomInterface` whose keys are names of properties."""


def with_values(owner: Any, values: Mapping[str, Any], path: str = "") -> Any:
    """Return a copy of a model object with dotted keys replaced, all of them at once.

    Messages begin with `path`, the dotted key of the object itself.

    Raises
    ------
    InputError
        If a key does not exist (the nearest valid one is named) or a value does not fit.
    """
    whole = {key: value for key, value in values.items() if "." not in key}
    inside: dict[str, dict[str, Any]] = {}
    for key in (key for key in values if "." in key):
        name, _, rest = key.partition(".")
        inside.setdefault(name, {})[rest] = values[key]
    if isinstance(owner, ScipyMarginal):
        return {"type": owner.type, **dict(owner.parameters), **whole}
    begin = f"{path}." if path else ""
    if isinstance(owner, Mapping):
        parts = {
            name: with_values(owner.get(name, {}), below, begin + name)
            for name, below in inside.items()
        }
        return {**owner, **whole, **parts}
    if not dataclasses.is_dataclass(owner) or isinstance(owner, type):
        raise InputError(f"{path}: has no keys of its own, it is {describe(owner)}")
    names = keys_of(type(owner))
    used = dict.fromkeys(key.split(".")[0] for key in values)
    unknown = [unknown_name(path or "sweep", name, names) for name in used if name not in names]
    if unknown:
        raise InputError(unknown)
    changes = {names[name]: value for name, value in whole.items()}
    for name, below in inside.items():
        part = getattr(owner, names[name])
        part = {} if part is None and name in MAPPINGS else part
        changes[names[name]] = with_values(part, below, begin + name)
    try:
        return dataclasses.replace(owner, **changes)
    except InputError as error:
        kind = f"{type(owner).__name__}."
        texts = (text.removeprefix(kind) for text in error.problems)
        raise InputError([begin + text for text in texts]) from None
