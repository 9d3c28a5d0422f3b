"""Friction laws. `kernels.py` evaluates their strength inside compiled kernels."""

from stiction.problem.friction.laws import SCALES as SCALES
from stiction.problem.friction.laws import ExponentialWeakening as ExponentialWeakening
from stiction.problem.friction.laws import Friction as Friction
from stiction.problem.friction.laws import FrictionLaw as FrictionLaw
from stiction.problem.friction.laws import LinearWeakening as LinearWeakening
from stiction.problem.friction.laws import PiecewiseWeakening as PiecewiseWeakening
from stiction.problem.friction.laws import contradictions as contradictions
