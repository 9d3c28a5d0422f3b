"""Friction laws: how strength falls with slip.

`law.py` says what a law is, `kernels.py` how compiled kernels evaluate one; each law is a file. To
add one, write a class like those here and add it to `Friction`; in Python, an object of any class
that derives from `FrictionLaw` serves.
"""

from __future__ import annotations

from typing import Annotated, Any, TypeAlias

from pydantic import Discriminator, GetJsonSchemaHandler, Tag
from pydantic_core import CoreSchema

from stiction.friction.exponential import ExponentialWeakening
from stiction.friction.law import FrictionLaw
from stiction.friction.linear import LinearWeakening
from stiction.friction.piecewise import PiecewiseWeakening
from stiction.model import describe


def _tag(value: Any) -> str:
    if isinstance(value, dict):
        return str(value.get("type", "linear"))
    if isinstance(value, LinearWeakening | ExponentialWeakening | PiecewiseWeakening):
        return value.type
    return "own" if isinstance(value, FrictionLaw) else describe(value)


class _Schema:
    """For editors: a table without a type is the linear law, and files hold no laws of others."""

    def __get_pydantic_json_schema__(
        self, core: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        linear, *others, _ = handler(core)["oneOf"]
        return {"anyOf": [linear, *({"allOf": [law, {"required": ["type"]}]} for law in others)]}


Friction: TypeAlias = Annotated[
    Annotated[LinearWeakening, Tag("linear")]
    | Annotated[ExponentialWeakening, Tag("exponential")]
    | Annotated[PiecewiseWeakening, Tag("piecewise")]
    | Annotated[FrictionLaw, Tag("own")],
    Discriminator(_tag),
    _Schema(),
]
"""Any friction law; in a study file ``type`` says which, linear if left out."""
