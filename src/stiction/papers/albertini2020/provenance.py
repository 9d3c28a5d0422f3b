"""What a reader needs to compute the page again: parameters, versions, times."""

from __future__ import annotations

import platform
import time
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np

from stiction import __version__
from stiction.papers.albertini2020.data import Data

_PACKAGES = ("numpy", "scipy", "numba", "rocket-fft", "xarray", "netCDF4", "pydantic", "matplotlib")


def parameters(data: Data) -> list[tuple[str, str]]:
    setting = data.setting
    problem = setting.problem
    solid, interface = problem.solid, problem.interface
    rate = float(np.max(problem.friction.weakening_rate))
    length = problem.nucleation_length
    deviation = setting.field(data.ratios[0]).standard_deviation
    return [
        (
            "Solid",
            f"G = {solid.shear_modulus:g} Pa, nu = {solid.poisson_ratio:g},"
            f" rho = {solid.density:g} kg/m^3, plane {solid.plane}",
        ),
        ("Effective modulus", f"G* = {problem.effective_modulus:.6g} Pa (mode {problem.mode})"),
        ("Interface", f"L = {interface.length:g} m, {interface.size} nodes"),
        (
            "Friction",
            f"W = {rate:g} Pa/m, residual strength"
            f" {float(np.mean(problem.friction.residual_strength)):g} Pa",
        ),
        (
            "Nucleation length",
            f"h_n = {length * 1e3:.4g} mm, L/h_n ="
            f" {interface.extent / length:.4g},"
            f" {length / interface.spacing:.1f} nodes",
        ),
        (
            "Strength",
            f"{_marginal(setting.marginal)}; mean {setting.mean * 1e-6:.6g} MPa,"
            f" standard deviation {deviation * 1e-6:.4g} MPa",
        ),
        (
            "Spectrum",
            f"(k^2 + lambda^2)^-{setting.exponent:g}, truncated at"
            f" {setting.truncation:g} lambda, {'with' if setting.mean_mode else 'without'} the mean"
            " mode",
        ),
        ("Correlation lengths", "xi_0/h_n = " + ", ".join(f"{ratio:g}" for ratio in data.ratios)),
        ("Samples", f"{data.samples:,} at each correlation length, seed {data.seed}"),
        ("Ruptures", _rupture_counts(data)),
    ]


def _rupture_counts(data: Data) -> str:
    parts = []
    if "ruptures" in data.studies:
        study = data["ruptures"]
        ratios = ", ".join(f"{ratio:g}" for ratio in data.setting.simulated_ratios)
        parts.append(
            f"{study.sizes['sample']} at each of xi_0/h_n = {ratios}, at"
            f" {study.attrs['loading_rate']:g} Pa/s"
        )
    if "dynamic" in data.studies:
        parts.append(f"{data['dynamic'].sizes['sample']:,} at each correlation length")
    return "; ".join(parts) or "none"


def _marginal(marginal: Any) -> str:
    if hasattr(marginal, "alpha"):
        return (
            f"Beta({marginal.alpha:g}, {marginal.beta:g}) on"
            f" [{marginal.low * 1e-6:g}, {marginal.high * 1e-6:g}] MPa"
        )
    given = ", ".join(f"{key} = {value:g}" for key, value in marginal.parameters)
    return f"{marginal.type} with {given}"


def provenance(data: Data, seconds: float) -> list[tuple[str, str]]:
    versions = []
    for package in _PACKAGES:
        try:
            versions.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    times = ", ".join(
        f"{dataset.attrs['title']} {dataset.attrs['seconds']:.1f} s"
        for dataset in data.studies.values()
    )
    return [
        ("Computed", time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())),
        ("stiction", __version__),
        ("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
        ("Packages", ", ".join(versions)),
        ("Time taken", f"{seconds:.1f} s before this page was written"),
        (
            "Processor time",
            f"{times} (of all cores, with the compilation met on the way)" if times else "none",
        ),
        ("Results", "results.nc (one group a study), tables/*.csv, figures/*.png and *.pdf"),
        (
            "Local criterion",
            "local criterion of Uenishi and Rice (2003), exact eigenfunction, minimum"
            " between the nodes",
        ),
    ]
