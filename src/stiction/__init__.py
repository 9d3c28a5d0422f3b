"""The statistics of static friction: at which load, and where, does this interface let go?"""

from __future__ import annotations

from importlib import import_module
from typing import Any

__version__ = "0.1.0"

# Public name -> module that holds it; imported on first use, so that `import stiction` is quick.
_HOMES = {
    "Solid": "solid",
    "Interface": "interface",
    "SlipWeakening": "friction.linear",
    "ExponentialWeakening": "friction.exponential",
    "PiecewiseWeakening": "friction.piecewise",
    "Load": "load",
    "Problem": "problem",
    "RandomField": "random.random_field",
    "RandomInterface": "random.random_interface",
    "Beta": "random.marginals",
    "PowerLawSpectrum": "random.spectra",
    "SquaredExponentialSpectrum": "random.spectra",
    "ExponentialSpectrum": "random.spectra",
    "CustomSpectrum": "random.spectra",
    "LocalCriterion": "criterion.method",
    "nucleation_stress": "criterion.nucleation",
    "Equilibrium": "equilibrium.method",
    "equilibrium_events": "equilibrium.events",
    "equilibrium_path": "equilibrium.path",
    "Rupture": "dynamics.method",
    "simulate_rupture": "dynamics.simulate",
    "open_rupture": "dynamics.stream",
    "read_profile": "profiles",
    "onset": "evaluation",
    "monte_carlo": "ensemble.monte_carlo",
    "nucleation_statistics": "statistics.moments",
    "nucleation_limits": "statistics.moments",
    "combined_mean": "statistics.control_variates",
    "density": "statistics.densities",
    "quantiles": "statistics.quantiles",
    "rice_distribution": "statistics.rice",
    "failure_probability": "reliability.estimate",
    "FailureProbability": "reliability.result",
    "DesignStress": "reliability.design",
    "design_stress": "reliability.design",
    "failure_curve": "reliability.curve",
    "Ensemble": "study.study",
    "Study": "study.study",
    "Cluster": "ensemble.distributed",
    "open_run": "stored_run",
    "StoredRun": "stored_run",
    "RunError": "errors",
    "StoreError": "errors",
    "InputError": "errors",
    "AccuracyWarning": "errors",
    "UnitWarning": "errors",
}
_MODULES = {"paper": "papers.albertini2020"}

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
