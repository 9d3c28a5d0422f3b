"""Frozen, validated parameter objects: one definition serves Python, TOML and JSON."""

from __future__ import annotations

import dataclasses
import functools
import numbers
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, dataclass_transform, overload

import numpy as np
import pydantic
import pydantic_core
from pydantic import BeforeValidator, ConfigDict, Field, PlainSerializer, WithJsonSchema
from pydantic.dataclasses import dataclass as pydantic_dataclass

from stiction._brief import brief, brief_html
from stiction._typing import Array
from stiction.errors import InputError, unknown_name

T = TypeVar("T")


def _number(value: Any) -> Any:
    """Numbers of any library, but no strings and no booleans, which pydantic would convert."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise ValueError("must be a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("must be finite") from None


def whole(value: Any) -> int | None:
    """`value` as an int if it is a whole number (1e4 too), None otherwise."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return None
    if isinstance(value, numbers.Integral):
        return int(value)
    number = float(value)
    return int(number) if number.is_integer() else None


def _count(value: Any) -> Any:
    count = whole(value)
    if count is None:
        raise ValueError("must be a whole number")
    return count


def names_to_keep(value: Any) -> tuple[str, ...]:
    """One name or several, as a tuple."""
    several = isinstance(value, list | tuple | set | frozenset)
    names = tuple(value) if several else (value,)
    if not all(isinstance(name, str) for name in names):
        raise InputError(f"keep: must be a name or a list of names, got {describe(value)}")
    return names


def real_array(value: Any) -> Array:
    """`value` as a float64 array, or a TypeError that says what it is instead."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise TypeError("got a masked array")
    try:
        given = np.asarray(value)
    except ValueError:
        raise TypeError("got rows of unequal length") from None
    if given.dtype.kind not in "fiu":
        kind = type(value).__name__ if given.ndim == 0 else f"elements of type {given.dtype}"
        raise TypeError(f"got {kind}")
    return np.ascontiguousarray(given, dtype=np.float64).reshape(given.shape)


def is_unplaced(value: Any) -> bool:
    """Whether a profile has coordinates or units of its own, which its problem resolves."""
    own = ("dims", "to_xarray", "magnitude", "to_value")
    return isinstance(value, dict) or any(hasattr(value, name) for name in own)


def _profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    """A number, a read-only float64 array of shape (*shape), or what a problem will place.

    In a study file also what its reader takes: a path, or a table {file, ...} with options.
    """
    read = (info.context or {}).get("read")
    if isinstance(value, str | Path | dict) and read is not None:
        value = read(value, str(info.field_name))
    if isinstance(value, str | Path):
        raise ValueError(
            "file names belong in a study file; in Python give a number, an array or"
            " st.read_profile(path)"
        )
    if is_unplaced(value):
        return value
    if isinstance(value, numbers.Real) or (isinstance(value, np.ndarray) and value.ndim == 0):
        number = _number(value)
        if not np.isfinite(number):
            raise ValueError("must be finite")
        return number
    try:
        array = np.array(real_array(value))
    except TypeError as error:
        raise ValueError(f"must be a number or an array of numbers, {error}") from None
    if array.ndim == 2 and 1 in array.shape:  # a column, as out of a table
        array = array.reshape(-1)
    if array.ndim not in (1, 2) or array.size == 0:
        raise ValueError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"must be finite; entry {int(np.argmin(np.isfinite(array)))} is not")
    array.flags.writeable = False
    return array


def _plain(value: Any) -> Any:
    if hasattr(value, "plain"):
        return value.plain()
    return value.tolist() if isinstance(value, np.ndarray) else value


Real: TypeAlias = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, allow_inf_nan=False)]
Count: TypeAlias = Annotated[int, BeforeValidator(_count), Field(ge=1)]
_PROFILE_SCHEMA = [
    {"type": "number"},
    {"type": "array", "items": {"type": "number"}},
    {"type": "string", "description": "path to a .npy, text or NetCDF file"},
    {"type": "object", "description": "file, and options of read_profile: unit, x_unit, ..."},
]
Profile: TypeAlias = Annotated[
    Any,
    BeforeValidator(_profile),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": _PROFILE_SCHEMA}),
]
"""A number, or a read-only array of shape (nodes,)."""


def _optional_profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    return None if value is None else _profile(value, info)


OptionalProfile: TypeAlias = Annotated[
    Any,
    BeforeValidator(_optional_profile),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": [*_PROFILE_SCHEMA, {"type": "null"}]}),
]
"""The same, or None for 'not given'."""


def _truth(value: Any) -> Any:
    if not isinstance(value, bool | np.bool_):
        raise ValueError("must be True or False")
    return bool(value)


Flag: TypeAlias = Annotated[bool, BeforeValidator(_truth)]


def describe(value: Any) -> str:
    """Short form of what was given, for messages."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _models_in(annotation: Any) -> list[type]:
    """The model classes that an annotation mentions: X, X | Y, Annotated[X | Y, ...]."""
    if dataclasses.is_dataclass(annotation):
        return [annotation] if isinstance(annotation, type) else []
    return [cls for part in typing.get_args(annotation) for cls in _models_in(part)]


def _walk(cls: type, location: tuple[int | str, ...]) -> tuple[list[str], list[str]]:
    """Path as the user wrote it, and the keys valid in its last-but-one step.

    Pydantic numbers positional arguments and puts the chosen member of a union into the path.
    """
    path: list[str] = []
    classes = [cls]
    for step in location:
        members = {getattr(c, "type", None): c for c in classes}
        if len(classes) > 1 and step in members:
            classes = [members[step]]
            continue
        fields = {f.name: f for c in classes for f in dataclasses.fields(c) if f.init}
        valid = list(fields)
        if isinstance(step, int) and step < len(valid):
            step = valid[step]
        path.append(str(step))
        if step in fields and step is not location[-1]:
            owner = next(c for c in classes if str(step) in {f.name for f in dataclasses.fields(c)})
            hints = typing.get_type_hints(owner, include_extras=True)
            classes = _models_in(hints[str(step)])
    valid = [f.name for c in classes for f in dataclasses.fields(c) if f.init]
    return path, valid


def explain(
    error: pydantic.ValidationError, cls: type, root: str = "", prefix: tuple[str, ...] = ()
) -> list[str]:
    """The mistakes that pydantic found in a `cls`, one text each, with the path to the key.

    `prefix` says which part of the `cls` was validated, if not all of it.
    """
    texts = []
    items = error.errors()
    if any(item["type"] == "unexpected_positional_argument" for item in items):
        names = [field.name for field in dataclasses.fields(cls) if field.init]
        return [f"{cls.__name__}: give its arguments by name (valid: {', '.join(names)})"]
    for item in items:
        steps, valid = _walk(cls, (*prefix, *item["loc"]))
        path = ".".join([root, *steps] if root else steps)
        kind, message, given = item["type"], item["msg"], item.get("input")
        message = message.removeprefix("Value error, ").removeprefix("Assertion failed, ")
        if kind in ("missing", "missing_argument"):
            texts.append(f"{path}: missing")
        elif kind in ("unexpected_keyword_argument", "extra_forbidden"):
            owner, _, key = path.rpartition(".")
            texts.append(unknown_name(owner or cls.__name__, key, valid))
        elif kind == "union_tag_invalid":
            tags = [tag.strip("' ") for tag in item["ctx"]["expected_tags"].split(",")]
            texts.append(unknown_name(f"{path}.type", str(item["ctx"]["tag"]), tags))
        elif kind == "union_tag_not_found":
            texts.append(f"{path}.type: missing, got {describe(given)}")
        elif kind == "value_error":
            nested = (item.get("ctx") or {}).get("error")
            if isinstance(nested, InputError):
                texts.extend(f"{path}: {text}" if path else text for text in nested.problems)
            else:
                texts.append(f"{path}: {message}, got {describe(given)}")
        else:
            message = message.removeprefix("Input should be ")
            texts.append(f"{path}: must be {message}, got {describe(given)}")
    return texts


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, np.ndarray) or isinstance(right, np.ndarray):
        return np.array_equal(left, right)
    if hasattr(left, "identical"):
        return type(left) is type(right) and bool(left.identical(right))
    return bool(left == right)


def _equal(self: Any, other: Any) -> bool:
    if type(self) is not type(other):
        return NotImplemented
    fields = dataclasses.fields(self)
    return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields)


def _hashable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return (value + 0.0).tobytes()  # zeros of both signs are equal, so they must hash alike
    if hasattr(value, "identical"):  # labelled arrays cannot be hashed
        return np.asarray(value).tobytes()
    if isinstance(value, dict):
        return tuple((key, _hashable(inner)) for key, inner in value.items())
    if isinstance(value, list):
        return tuple(map(_hashable, value))
    return value


def _hash(self: Any) -> int:
    return hash(tuple(_hashable(getattr(self, field.name)) for field in dataclasses.fields(self)))


@overload
def model(cls: type[T]) -> type[T]: ...
@overload
def model(*, kw_only: bool = ...) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def model(cls: Any = None, *, kw_only: bool = False) -> Any:
    """Class decorator: a frozen pydantic dataclass whose mistakes come as `InputError`.

    Objects compare by value (arrays too) and hash by value. Consistency checks go into a method
    decorated with ``pydantic.model_validator(mode="after")`` that raises `InputError`.
    """
    if cls is None:
        return functools.partial(model, kw_only=kw_only)
    config = ConfigDict(extra="forbid", arbitrary_types_allowed=True)
    bare = cls.__repr__ in (object.__repr__, brief)  # its own, if it has one, stays
    wrapped: Any = pydantic_dataclass(frozen=True, eq=False, kw_only=kw_only, config=config)(cls)
    validated_init = wrapped.__init__

    @functools.wraps(validated_init)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            validated_init(self, *args, **kwargs)
        except pydantic.ValidationError as error:
            raise InputError(explain(error, wrapped, cls.__name__)) from None
        except TypeError as error:  # too many positional arguments, for example
            raise InputError(f"{cls.__name__}: {error}") from None

    # Validation inside another model must keep calling pydantic's own path, not this wrapper.
    init.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # pydantic's own marker
    wrapped.__init__ = init
    wrapped.__eq__ = _equal
    if bare:
        wrapped.__repr__ = brief
    wrapped._repr_html_ = brief_html
    wrapped.__hash__ = _hash
    return wrapped


def to_plain(value: Any) -> Any:
    """The object as plain dicts, lists and numbers: what TOML and JSON hold.

    Raises
    ------
    InputError
        If something in it exists in Python only, such as a function.
    """
    try:
        return pydantic.TypeAdapter(type(value)).dump_python(value, mode="json", exclude_none=True)
    except pydantic_core.PydanticSerializationError as error:
        reason = str(error).removeprefix("Error calling function ").split(": ", 1)[-1]
        raise InputError(f"{type(value).__name__}: cannot be written down: {reason}") from None
    except pydantic.errors.PydanticSchemaGenerationError:
        raise InputError(f"{type(value).__name__}: exists in Python only") from None


Mode: TypeAlias = Literal["II", "III"]
