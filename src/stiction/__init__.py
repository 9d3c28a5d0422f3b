"""The statistics of static friction: at which load, and where, does this interface let go?"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Public name -> module that holds it; imported on first use, so that `import stiction` is quick.
_HOMES = {
    "Solid": "solid",
    "Interface": "interface",
    "LinearWeakening": "friction",
    "ExponentialWeakening": "friction",
    "PiecewiseWeakening": "friction",
    "Load": "load",
    "GradientLoad": "load",
    "EdgeLoad": "load",
    "Problem": "problem",
    "RandomField": "random.random_field",
    "RandomInterface": "random.random_interface",
    "Beta": "random.marginals",
    "Lognormal": "random.marginals",
    "Weibull": "random.marginals",
    "Gamma": "random.marginals",
    "TruncatedNormal": "random.marginals",
    "PowerLawSpectrum": "random.spectra",
    "SquaredExponentialSpectrum": "random.spectra",
    "ExponentialSpectrum": "random.spectra",
    "CustomSpectrum": "random.spectra",
    "LocalCriterion": "criterion.local",
    "Equilibrium": "equilibrium.method",
    "equilibrium_path": "equilibrium.path",
    "Rupture": "dynamics.method",
    "simulate_rupture": "dynamics.simulate",
    "Save": "dynamics.save",
    "read_profile": "profiles",
    "onset": "methods",
    "monte_carlo": "ensemble.monte_carlo",
    "fit_field": "inference.fit",
    "failure_probability": "reliability.failure",
    "design_stress": "reliability.failure",
    "failure_curve": "reliability.curve",
    "read_peaks": "inference.peaks",
    "infer": "inference.infer",
    "design_of_tests": "inference.design",
    "Ensemble": "ensemble.experiment",
    "Study": "study.study",
    "open_run": "study.study",
    "RunError": "errors",
    "InputError": "errors",
    "AccuracyWarning": "errors",
    "UnitWarning": "errors",
}
_MODULES = {
    "external": "external",
    "paper": "paper",
    "plot": "plot",
    "statistics": "statistics",
    "theory": "theory",
}

__all__ = ["__version__", *_HOMES, *_MODULES]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"stiction.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    if name in _MODULES:
        return import_module(f"stiction.{_MODULES[name]}")
    raise AttributeError(f"module 'stiction' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
