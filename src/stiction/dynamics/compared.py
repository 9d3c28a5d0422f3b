"""Rupture with a record beside it: the misfit as one more result of every sample."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pydantic
from numpy.typing import NDArray
from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema

from stiction.dynamics.method import Rupture
from stiction.dynamics.misfit import misfit, read_record
from stiction.dynamics.simulate import simulate_rupture
from stiction.model import Count, FilePath, check, model
from stiction.problem import Problem, Sample
from stiction.results import Variable

_COMPARED = {
    "misfit": Variable("1", "root mean square difference from the record over that of the record"),
    "time_shift": Variable("s", "what is added to the times of the record for the best fit"),
}
_PROFILES = ("strength", "residual_strength", "weakening_rate", "initial_stress")


def _record(value: Any, info: pydantic.ValidationInfo) -> Path:
    """The path of a record that can be read; in a study file relative to it."""
    path = check("record", value, FilePath)
    folder = (info.context or {}).get("folder")
    path = path if folder is None else Path(folder) / path
    read_record(path)
    return path.absolute()


@model(kw_only=True)
class RuptureMisfit(Rupture):
    """`Rupture` with the misfit from a record of gauges, for sweeps: which d_c fits best?

    Parameters
    ----------
    record : path
        Table of a record, as in `misfit`; in a study file beside it.
    frames_every : int
        Explicit steps between the frames that are compared.

    Notes
    -----
    All options and results of `Rupture`, and `misfit` and `time_shift` (s); in a study file
    ``type = "rupture_misfit"``.
    """

    record: Annotated[
        Any,
        BeforeValidator(_record),
        PlainSerializer(lambda value: str(value)),  # pydantic 2.7 takes no bare `str`
        WithJsonSchema({"type": "string"}),
    ]
    frames_every: Count = 5
    type: Literal["rupture_misfit"] = "rupture_misfit"  # type: ignore[assignment]  # its own name

    @property
    def label(self) -> str:
        """Its name in figures and tables."""
        return "rupture against a record"

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """What the solver returns for each sample."""
        return super().variables(problem) | _COMPARED

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, NDArray[Any]]]:
        """A solver for rows of this problem."""
        record = read_record(self.record)
        kept = "slip" if record.name == "strain" else str(record.name)
        own = {f.name: getattr(self, f.name) for f in dataclasses.fields(Rupture)}
        plain = Rupture(**{name: value for name, value in own.items() if name != "type"})

        def one(rows: Sample) -> dict[str, float]:
            run = simulate_rupture(
                problem,
                {name: getattr(rows, name)[0] for name in _PROFILES},
                method=plain,
                variables=(kept,),
                every=self.frames_every,
                steps=False,
                progress=False,
            )
            found = misfit(run, record)
            # Energies and moment are histories: their ends count.
            ends = {name: np.ravel(run[name].values)[-1] for name in plain.variables(problem)}
            scalars = {name: float(value) for name, value in ends.items()}
            return scalars | {"misfit": found.misfit, "time_shift": found.time_shift}

        def solve(rows: Sample) -> dict[str, NDArray[Any]]:
            found = [one(rows.part(slice(i, i + 1))) for i in range(rows.samples)]
            return {name: np.array([own[name] for own in found]) for name in found[0]}

        return solve
