"""The figure and the sentences of the what-if on correlated residual strength."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from what_if_plots import axes_of, events_of, longest, percent

import stiction as st
from stiction.plot.style import marker, series

RUPTURES = 60
LOADING_RATE = 2e7  # Pa/s
RHO = r"correlation of $\tau_\mathrm{p}$ and $\tau_\mathrm{r}$"


def standard_error(values: np.ndarray) -> np.ndarray:
    """Of the mean over the last axis."""
    return values.std(axis=-1, ddof=1) / np.sqrt(values.shape[-1])


def points(axes: Axes, x: np.ndarray, mean: np.ndarray, error: np.ndarray, i: int, label: str):
    """Means with bars of two standard errors."""
    axes.errorbar(
        x, mean, 2.0 * error, marker=marker(i), capsize=2.0, elinewidth=0.8, label=label,
        **series(i),
    )  # fmt: skip


def number(mean: float, error: float, digits: int = 2) -> str:
    """A mean with its standard error."""
    return f"{mean:.{digits}f} ± {error:.{digits}f}".replace("-", "\u2212")


def minus(value: float) -> str:
    """With a minus sign as in print."""
    return f"{value:g}".replace("-", "\u2212")


def ruptures(study: st.Study, samples: int) -> np.ndarray:
    """Stress drop, Pa, of elastodynamic ruptures at the shorter correlation length."""
    method = st.Rupture(loading_rate=LOADING_RATE)
    drops = []
    for plan in study.plans[::2]:
        found = st.monte_carlo(
            plan.problem, plan.random, method=method, samples=samples, seed=study.ensemble.seed
        )
        drops.append(found["stress_drop"].values)
    return np.array(drops)


def correlation(study: st.Study, result: xr.Dataset) -> tuple[Figure, list[str]]:
    """Onset, arrest and stress drop against the correlation of tau_p and tau_r."""
    figure, (change, arrested, drop) = axes_of(3)
    rho = result["correlation_strength_residual_strength"].values
    zero = int(np.argmin(np.abs(rho)))
    ratios = result["strength_spectrum_correlation_length"].values
    ratios = ratios / study.plans[0].problem.nucleation_length
    first, last = (result[key].values for key in ("first_instability", "critical_stress"))
    # The strength is the same at every correlation, sample by sample: differences are paired.
    onset, sliding = (100.0 * (values / values[zero] - 1.0) for values in (first, last))
    some = (result["arrested_events"].values > 0).astype(float)
    share = some.mean(axis=-1)
    share_error = np.sqrt(share * (1.0 - share) / some.shape[-1])
    static = last - result["residual_strength"].values.mean(axis=-1)
    dynamic = ruptures(study, min(RUPTURES, some.shape[-1]))
    for i, ratio in enumerate(ratios):
        label = rf"$\xi_0/h_\mathrm{{n}}$ = {ratio:.1f}"
        moved = sliding[:, i]
        points(change, rho, moved.mean(axis=-1), standard_error(moved), i, label)
        points(arrested, rho, 100.0 * share[:, i], 100.0 * share_error[:, i], i, label)
        kilo = 1e-3 * static[:, i]
        points(drop, rho, kilo.mean(axis=-1), standard_error(kilo), i, label)
    kilo = 1e-3 * dynamic
    points(drop, rho, kilo.mean(axis=-1), standard_error(kilo), 2, "ruptures, 0.5")
    change.set_ylabel("critical stress, change (%)")
    arrested.set_ylabel("samples with arrested events (%)")
    drop.set_ylabel("stress drop (kPa)")
    for axes in (change, arrested, drop):
        axes.set_xlabel(RHO)
        axes.legend()
    arrested.set_ylim(bottom=0)
    events = events_of(study, result, ("strength", "residual_strength"))
    longer, shorter = (longest(study, events[k : k + 1]) for k in (0, 2 * (rho.size - 1)))
    low = minus(rho[0])
    paired = 1e-3 * (static[0, 0] - static[-1, 0])
    moving = 1e-3 * (dynamic[0] - dynamic[-1])
    return figure, [
        "Arrest is decided by what the residual strength is where the strength is low. At"
        f" xi_0/h_n = 0.5 and a correlation of {low} weak places lose little strength, and"
        f" {number(100 * share[0, 0], 100 * share_error[0, 0], 1)} % of samples have an arrested"
        f" event; without correlation {number(100 * share[zero, 0], 100 * share_error[zero, 0], 1)}"
        f" %, and at 1, where the residual strength is a function of the strength,"
        f" {number(100 * share[-1, 0], 100 * share_error[-1, 0], 1)} %. At xi_0/h_n = 2 the three"
        f" are {', '.join(percent(share[k, 1]) for k in (0, zero, -1))}. The longest arrested patch"
        f" at xi_0/h_n = 0.5 is {longer} nucleation lengths long at {low}, {shorter} at 1.",
        "The first instability depends on it only where nodes reach their residual strength before:"
        f" at {low} it rises by {number(onset[0, 0].mean(), standard_error(onset[0, 0]))} %"
        f" against no correlation, at 1 it falls by"
        f" {number(-onset[-1, 0].mean(), standard_error(onset[-1, 0]))} %. Global sliding comes"
        f" {number(sliding[0, 0].mean(), standard_error(sliding[0, 0]))} % later at {low},"
        f" {number(-sliding[-1, 0].mean(), standard_error(sliding[-1, 0]))} % earlier at 1 (at"
        f" xi_0/h_n = 2: {number(sliding[0, 1].mean(), standard_error(sliding[0, 1]))} % and"
        f" {number(-sliding[-1, 1].mean(), standard_error(sliding[-1, 1]))} %).",
        "The stress drop of global sliding, the critical stress less the mean residual strength,"
        f" is {number(1e-3 * static[0, 0].mean(), 1e-3 * standard_error(static[0, 0]), 1)} kPa at"
        f" {low} and"
        f" {number(1e-3 * static[-1, 0].mean(), 1e-3 * standard_error(static[-1, 0]), 1)} kPa at 1,"
        f" sample by sample {number(paired.mean(), standard_error(paired), 1)} kPa or"
        f" {percent(1e3 * paired.mean() / static[-1, 0].mean())} less. The mean residual strength"
        " is the same, so this is the change of the critical stress and no more."
        f" {dynamic.shape[-1]} elastodynamic ruptures at each correlation, loaded at"
        f" {LOADING_RATE / 1e6:.0f} MPa/s, say {number(moving.mean(), standard_error(moving), 1)}"
        " kPa less.",
        "Errors are one standard error, bars in the figure two. All correlations have the same"
        " strengths, sample by sample, so that differences are taken in pairs.",
    ]
