"""A study: problem, strength, method and ensemble in one object, from Python or one TOML file."""

from __future__ import annotations

import functools
import json
import operator
import tomllib
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import pydantic
import tomli_w
import xarray as xr
from pydantic import BeforeValidator, Field, model_validator

from stiction._model import Count, _count, describe, explain, model, to_plain
from stiction.ensemble.plan import Plan
from stiction.ensemble.run import make_plan, run_plan
from stiction.errors import InputError
from stiction.fields.random_field import RandomField
from stiction.problem import Problem



def _known_methods() -> list[type]:
    """The methods of the rooms that are there."""
    found = []
    for module, name in METHODS.items():
        with suppress(ImportError):
            found.append(getattr(import_module(f"stiction.{module}"), name))
    return found


METHODS = {
    "criterion.method": "LocalCriterion",
    "equilibrium.method": "Equilibrium",
    "dynamics.method": "Rupture",
}
if TYPE_CHECKING:
    AnyMethod: TypeAlias = Any
else:
    _found = _known_methods()
    AnyMethod = _found[0]
    if len(_found) > 1:
        AnyMethod = Annotated[functools.reduce(operator.or_, _found), Field(discriminator="type")]
Number = Annotated[int, BeforeValidator(_count), Field(ge=0)]


@model(kw_only=True)
class Ensemble:
    """How many samples, and which.

    Parameters
    ----------
    samples : int
        Number of samples.
    seed : int
        Not negative.
    first : int
        Number of the first sample.
    keep : tuple of str
        Random fields whose sampled profiles are kept, such as ``("strength",)``.
    """

    samples: Count
    seed: Number = 0
    first: Number = 0
    keep: tuple[str, ...] = ()


@model(kw_only=True)
class Study:
    """Everything that defines a Monte Carlo study.

    The same names serve Python and TOML; a study read from the attributes of a result runs again
    to the same numbers.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    ensemble : Ensemble
    residual_strength, initial_stress, weakening_rate : RandomField, optional
        What is random besides the strength.
    title : str
        For people.

    Raises
    ------
    InputError
        Naming every key that is missing, unknown or out of range.
    """

    problem: Problem
    strength: RandomField
    method: AnyMethod
    ensemble: Ensemble
    residual_strength: RandomField | None = None
    initial_stress: RandomField | None = None
    weakening_rate: RandomField | None = None
    title: str = ""

    @model_validator(mode="after")
    def _fits_together(self) -> Study:
        self.plan()
        return self

    def plan(self) -> Plan:
        """The same as a plan of computation."""
        fields = {
            "residual_strength": self.residual_strength,
            "initial_stress": self.initial_stress,
            "weakening_rate": self.weakening_rate,
        }
        keep, seed = self.ensemble.keep, self.ensemble.seed
        return make_plan(self.problem, self.strength, self.method, seed, fields, keep)

    def run(
        self,
        *,
        workers: int | None = None,
        executor: Executor | None = None,
        progress: bool | Callable[[int, int], None] = False,
    ) -> xr.Dataset:
        """Run it; see `stiction.monte_carlo` for the arguments and the result."""
        result = run_plan(
            self.plan(),
            self.ensemble.samples,
            first=self.ensemble.first,
            workers=workers,
            executor=executor,
            progress=progress,
        )
        if self.title and "study" in result.attrs:
            result.attrs["study"] = json.dumps(self.to_dict())
            result.attrs["title"] = self.title
        return result

    def to_dict(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, as in TOML.

        Raises
        ------
        InputError
            If something in it exists in Python only (a spectrum that is a function).
        """
        plain: dict[str, Any] = to_plain(self)
        if not plain["title"]:
            del plain["title"]
        return plain

    def to_toml(self, path: str | Path) -> None:
        """Write it as a TOML file."""
        Path(path).write_text(tomli_w.dumps(self.to_dict()), encoding="utf-8")

    @classmethod
    def from_dict(cls, given: dict[str, Any], *, folder: str | Path | None = None) -> Study:
        """A study from plain dictionaries; file names of profiles are relative to `folder`."""
        try:
            study: Study = pydantic.TypeAdapter(cls).validate_python(
                given, context={"folder": folder}
            )
        except pydantic.ValidationError as error:
            raise InputError(explain(error, cls)) from None
        return study

    @classmethod
    def from_toml(cls, path: str | Path) -> Study:
        """A study from a TOML file."""
        path = Path(path)
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from None
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{path}: is not valid TOML: {error}") from None
        return cls.from_dict(given, folder=path.parent)

    @classmethod
    def from_result(cls, result: xr.Dataset) -> Study:
        """The study that made a result."""
        if "study" not in result.attrs:
            raise InputError(f"result: has no attribute 'study': {describe(type(result))}")
        return cls.from_dict(json.loads(result.attrs["study"]))


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file."""
    return pydantic.TypeAdapter(Study).json_schema()
