"""The question of a study: the failure probability of a demand, or the design for one."""

from __future__ import annotations

from typing import Any

from pydantic import model_validator

from stiction.base.errors import InputError
from stiction.base.model import Positive, Real, model
from stiction.ensemble.experiment import Experiment
from stiction.reliability.answer import Answer, Probability, TargetCv
from stiction.reliability.failure import design_stress, failure_probability


@model(kw_only=True)
class Question:
    """A demand, whose failure probability is asked for, or a probability, for a design.

    Parameters
    ----------
    stress, force, friction_coefficient : float, optional
        The demand, Pa, N or 1, as of `stiction.failure_probability`.
    probability : float, optional
        Instead: that of sliding below the design, as of `stiction.design_stress`.
    target_cv : float
        Coefficient of variation to reach.
    """

    stress: Real | None = None
    force: Positive | None = None
    friction_coefficient: Positive | None = None
    probability: Probability | None = None
    target_cv: TargetCv = 0.1

    @model_validator(mode="after")
    def _one(self) -> Question:
        given = [name for name, one in vars(self).items() if one is not None]
        asked = [name for name in given if name != "target_cv"]
        if len(asked) != 1:
            raise InputError(
                "give one of stress (Pa), force (N), friction_coefficient and probability, got"
                f" {' and '.join(asked) or 'none'}"
            )
        return self

    def answer(self, experiment: Experiment, workers: int | None = None) -> Answer:
        """Answer it for one point of a study."""
        options: dict[str, Any] = {
            name: one for name, one in vars(self).items() if one is not None
        }
        options |= {"method": experiment.method, "seed": experiment.seed, "workers": workers}
        ask = failure_probability if self.probability is None else design_stress
        return ask(experiment.problem, experiment.given, **options)
