"""Fields of a model that hold one of several classes, told apart by `type` in a study file."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import pydantic
from pydantic_core import CoreSchema, core_schema

from stiction.errors import InputError, unknown_name
from stiction.model import to_plain


class OneOf(NamedTuple):
    """Annotation of such a field.

    `kinds` are the classes by `type`: one that is added may be named in study files.
    `convert` maps what was given to an object of one of them; `also` tells editors what
    else a table may hold.
    """

    kinds: Mapping[str, Any]
    convert: Callable[[Any], Any]
    also: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        plain = core_schema.plain_serializer_function_ser_schema(_plain)
        return core_schema.no_info_plain_validator_function(self.convert, serialization=plain)

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: Any) -> dict[str, Any]:
        found = [pydantic.TypeAdapter(kind).json_schema() for kind in self.kinds.values()]
        if self.also:
            own = {"type": {"type": "string", "description": self.also}}
            found.append({"type": "object", "properties": own})
        return {
            "anyOf": [one | {"required": [*one.get("required", ()), "type"]} for one in found]
        }


def _plain(value: Any) -> Any:
    return value.plain() if hasattr(value, "plain") else to_plain(value)


def from_table(kinds: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
    """Make an object of the class that `type` names in a table, or raise an `InputError`."""
    rest = dict(given)
    name = rest.pop("type", None)
    if name is None:
        raise InputError(f"type: missing (valid: {', '.join(kinds)})")
    if not isinstance(name, str) or name not in kinds:
        raise InputError(unknown_name("type", str(name), kinds))
    return kinds[name](**rest)
