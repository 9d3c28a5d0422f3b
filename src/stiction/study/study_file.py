"""Study files as plain dictionaries, before they are made a study."""

import tomllib
from pathlib import Path
from typing import Any

import pydantic

from stiction.errors import InputError
from stiction.profiles import profile_in_file
from stiction.study.sweep import Sweep, unknown_keys


def read_toml(path: Path) -> dict[str, Any]:
    """Return what a TOML file holds; `InputError` if it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read: {error}") from None
    except RecursionError:
        raise InputError(f"{path}: is not valid TOML: nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: is not valid TOML: {error}") from None


def reading(folder: str | Path | None) -> dict[str, Any]:
    """Context of validation: profiles may be names of files relative to `folder`, unless None."""
    if folder is None:
        return {"folder": None}
    return {"folder": folder, "read": lambda given, name: profile_in_file(given, name, folder)}


def read_sweep(given: Any, folder: str | Path | None, study: type) -> tuple[Any, list[str]]:
    """Return the axes of a study in plain form and its unknown keys; nothing if unreadable."""
    if not isinstance(given, dict) or "sweep" not in given:
        return (), []
    try:
        adapter: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(Sweep)
        axes = adapter.validate_python(given["sweep"], context={"folder": folder})
    except pydantic.ValidationError:
        return (), []
    return axes, unknown_keys(study, axes)


def completed(given: dict[str, Any], axes: Any) -> dict[str, Any]:
    """Return the same with the first value of every swept key that has none of its own."""
    result = given
    for axis in axes:
        if not axis.steps:
            raise InputError(f"sweep: {', '.join(axis.keys) or 'an axis'}: has no values")
        for key, value in zip(axis.keys, axis.steps[0], strict=True):
            result = _with_default(result, key.split("."), value)
    return result


def _with_default(table: dict[str, Any], steps: list[str], value: Any) -> dict[str, Any]:
    name, *rest = steps
    if not rest:
        return table if name in table else table | {name: value}
    inner = table.get(name, {})
    if not isinstance(inner, dict):
        return table
    return table | {name: _with_default(inner, rest, value)}
