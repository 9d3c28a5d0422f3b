"""Fields of a model that hold one of several classes, distinguished by `type` in a study file."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import pydantic
from pydantic_core import CoreSchema, core_schema

from stiction.errors import InputError, unknown_name
from stiction.model import to_plain


class OneOf(NamedTuple):
    """Annotation of such a field.

    `kinds` are the classes by `type`: one that is added may be named in study files.
    `convert` maps what was given to an object of one of them, or returns NotImplemented to
    leave it to the annotated type; `also` are JSON schemas of what else the field may hold.
    """

    kinds: Mapping[str, Any]
    convert: Callable[[Any], Any]
    also: Sequence[Mapping[str, Any]] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        def read(value: Any, inner: Any) -> Any:
            found = self.convert(value)
            return inner(value) if found is NotImplemented else found

        own = handler(source)
        plain = core_schema.wrap_serializer_function_ser_schema(_plain, schema=own)
        return core_schema.no_info_wrap_validator_function(read, own, serialization=plain)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: Any) -> dict[str, Any]:
        found = [pydantic.TypeAdapter(kind).json_schema() for kind in self.kinds.values()]
        found = [one | {"required": [*one.get("required", ()), "type"]} for one in found]
        return {"anyOf": [*found, *self.also]}


def _plain(value: Any, handler: Any) -> Any:
    if hasattr(value, "plain"):
        return value.plain()
    return to_plain(value) if dataclasses.is_dataclass(value) else handler(value)


def from_table(kinds: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
    """Make an object of the class that `type` names in a table, or raise an `InputError`."""
    rest = dict(given)
    name = rest.pop("type", None)
    if name is None:
        raise InputError(f"type: missing (valid: {', '.join(kinds)})")
    if not isinstance(name, str) or name not in kinds:
        raise InputError(unknown_name("type", str(name), kinds))
    return kinds[name](**rest)
