"""Friction laws: the laws themselves, and in `kernels.py` what compiled kernels take of them."""

from stiction.friction.laws import SCALES as SCALES
from stiction.friction.laws import ExponentialWeakening as ExponentialWeakening
from stiction.friction.laws import Friction as Friction
from stiction.friction.laws import FrictionLaw as FrictionLaw
from stiction.friction.laws import LinearWeakening as LinearWeakening
from stiction.friction.laws import PiecewiseWeakening as PiecewiseWeakening
from stiction.friction.laws import contradictions as contradictions
