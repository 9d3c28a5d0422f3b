"""The table [inference] of a study file: the prior, and how peaks are judged by it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from stiction._checks import is_real
from stiction.errors import InputError
from stiction.inference.prior import distribution_of
from stiction.model import Count, _number, describe, model


def _is_distribution(value: Any) -> bool:
    """Whether a value is a range or a distribution, and not a table of more keys."""
    if not isinstance(value, Mapping):
        return True
    return isinstance(value.get("type"), str) or is_real(value.get("low"))


def flat_keys(given: Any, prefix: str = "") -> dict[str, Any]:
    """Dotted keys of a prior: TOML reads an unquoted ``marginal.low = ...`` as nested tables."""
    if not isinstance(given, Mapping):
        raise InputError(
            f"must be a table of parameters and ranges or distributions, got {describe(given)}"
        )
    found: dict[str, Any] = {}
    for key, value in given.items():
        name = f"{prefix}.{key}" if prefix else str(key)
        if _is_distribution(value):
            distribution_of(name, value)
            found[name] = value
        else:
            found |= flat_keys(value, name)
    return found


def _plain(prior: Mapping[str, Any]) -> dict[str, Any]:
    plain = {}
    for key, value in prior.items():
        if hasattr(value, "ppf"):
            raise ValueError(f"prior {key} is a Python distribution; write a range or a table")
        plain[key] = list(value) if isinstance(value, tuple) else value
    return plain


PriorTable = Annotated[
    Any,
    BeforeValidator(flat_keys),
    PlainSerializer(_plain),
    WithJsonSchema(
        {
            "type": "object",
            "description": "parameters, such as correlation_length or 'marginal.low', with a range"
            " [low, high], {low, high, spacing = 'log'}, or {type, ...} of scipy.stats",
        }
    ),
]
NotNegative = Annotated[float, BeforeValidator(_number), Field(ge=0, allow_inf_nan=False)]


@model(kw_only=True)
class Inference:
    """What `stiction infer` is told in a study file, in the table [inference].

    Parameters
    ----------
    prior : mapping
        As in `infer`; in TOML a range ``[low, high]``, a table ``{low, high, spacing}`` or
        ``{type = "norm", loc = ..., scale = ...}`` with the name of a `scipy.stats` distribution.
    load_cell_error : float
        Standard deviation, Pa, or of a coefficient of friction.
    samples : int, optional
        Simulated specimens at each point.
    """

    prior: PriorTable
    load_cell_error: NotNegative = 0.0
    samples: Count | None = None
