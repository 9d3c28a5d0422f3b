"""The statistics of static friction: at which load, and where, does this interface let go?"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

# Public name -> module that holds it; imported on first use, so that `import stiction` is quick.
_HOMES = {
    "Solid": "solid",
    "Interface": "interface",
    "SlipWeakening": "friction",
    "Load": "load",
    "Problem": "problem",
    "InputError": "errors",
    "AccuracyWarning": "errors",
    "LocalCriterion": "criterion.method",
    "nucleation_stress": "criterion.nucleation",
    "onset": "methods",
    "RandomField": "fields.random_field",
    "Beta": "fields.marginals",
    "PowerLawSpectrum": "fields.spectra",
    "SquaredExponentialSpectrum": "fields.spectra",
    "ExponentialSpectrum": "fields.spectra",
    "CustomSpectrum": "fields.spectra",
}
_MODULES = ("paper",)

__all__ = ["__version__", *_HOMES, *_MODULES]

if TYPE_CHECKING:
    from stiction.errors import AccuracyWarning, InputError
    from stiction.friction import SlipWeakening
    from stiction.interface import Interface
    from stiction.load import Load
    from stiction.problem import Problem
    from stiction.solid import Solid


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"stiction.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    if name in _MODULES:
        return import_module(f"stiction.{name}")
    raise AttributeError(f"module 'stiction' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
