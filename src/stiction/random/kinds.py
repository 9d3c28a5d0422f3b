"""Fields of a model that hold one of several classes, told apart by `type` in a study file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import pydantic
from pydantic_core import CoreSchema, core_schema

from stiction.errors import InputError, unknown_name
from stiction.model import to_plain


class OneOf(NamedTuple):
    """Annotation of such a field.

    Attributes
    ----------
    kinds : dict
        The classes by `type`. A class that is added here may be named in study files.
    convert, plain : callable
        Map what was given to an object of one of the classes, and that to what a file holds.
    also : str
        What a table may hold besides, for editors; empty if nothing.
    """

    kinds: Mapping[str, Any]
    convert: Callable[[Any], Any]
    plain: Callable[[Any], Any] = to_plain
    also: str = ""

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(
            self.convert,
            serialization=core_schema.plain_serializer_function_ser_schema(self.plain),
        )

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: Any) -> dict[str, Any]:
        found: list[Any] = []
        for kind in self.kinds.values():
            schema = pydantic.TypeAdapter(kind).json_schema()
            found.append(schema | {"required": [*schema.get("required", ()), "type"]})
        if self.also:
            own = {"type": {"type": "string", "description": self.also}}
            found.append({"type": "object", "properties": own, "required": ["type"]})
        return {"anyOf": found}


def from_table(kinds: Mapping[str, Any], given: Mapping[str, Any]) -> Any:
    """Make an object of the class that `type` names in a table.

    Raises
    ------
    InputError
        If there is no such class, or the rest of the table does not fit it.
    """
    rest = dict(given)
    name = rest.pop("type", None)
    if name is None:
        raise InputError(f"type: missing (valid: {', '.join(kinds)})")
    if not isinstance(name, str) or name not in kinds:
        raise InputError(unknown_name("type", str(name), kinds))
    return kinds[name](**rest)
