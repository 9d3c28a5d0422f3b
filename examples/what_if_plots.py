"""What the figures of the what-ifs have in common."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import stiction as st
from stiction.papers.albertini2020.claims.claim import rounded
from stiction.plot.style import PAGE, color, marker, new_figure, panel, series
from stiction.statistics.estimates import Estimate, share

XI = r"correlation length $\xi_0$ (mm)"


def axes_of(count: int) -> tuple[Figure, list[Axes]]:
    """Panels side by side, lettered."""
    figure = new_figure(PAGE, 2.5)
    panels = list(np.atleast_1d(figure.subplots(1, count)))
    for axes, letter in zip(panels, "abc", strict=False):
        panel(axes, letter)
    return figure, panels


def band(axes: Axes, x: Any, values: Any, index: int, label: str | None = None) -> None:
    """Mean over the last axis against x, with 5 to 95 % in a pale shade."""
    low, high = np.quantile(values, (0.05, 0.95), axis=-1)
    axes.fill_between(x, low, high, color=color(index), alpha=0.15, linewidth=0)
    axes.plot(x, np.mean(values, axis=-1), marker=marker(index), label=label, **series(index))


def logarithmic(axes: Axes, x: Any, label: str) -> None:
    """Ticks at the points of the sweep."""
    axes.set_xscale("log")
    axes.set_xticks(list(x), [f"{value:g}" for value in x])
    axes.minorticks_off()
    axes.set_xlabel(label)


def lengths(result: xr.Dataset) -> np.ndarray:
    """Correlation lengths of the sweep, mm."""
    return np.round(result["correlation_length"].values * 1e3, 3)


def percent(share: float) -> str:
    """A share for reading."""
    return f"{100.0 * share:.2g} %"


def told(statistic: Callable[..., Any], *arrays: Any, scale: float = 1.0) -> str:
    """A number made of samples with its standard error, '0.262 \u00b1 0.011'.

    Parameters
    ----------
    statistic : callable
        Of arrays with the samples on the last axis, to a number.
    *arrays : (..., samples) arrays
        Of the same samples, which are drawn again together, 200 times (bootstrap).
    scale : float
        Factor on both.
    """
    rows = [np.asarray(each) for each in arrays]
    generator = np.random.default_rng(0)
    count = rows[0].shape[-1]
    again = [
        statistic(*(row[..., chosen] for row in rows))
        for chosen in generator.integers(0, count, (200, count))
    ]
    estimate = Estimate(scale * float(statistic(*rows)), abs(scale) * float(np.std(again, ddof=1)))
    return rounded(estimate).replace("-", "\u2212")


def share_of(events: Any) -> str:
    """Share of samples with an event, in per cent, with its standard error."""
    return f"{rounded(share(np.asarray(events) > 0).scaled(100.0))} %"


def change(new: Any, old: Any) -> str:
    """Of the mean, signed, in per cent."""
    return f"{100.0 * (np.mean(new) / np.mean(old) - 1.0):+.2g} %".replace("-", "\u2212")


def events_of(study: st.Study, result: xr.Dataset, names: tuple[str, ...]) -> list[xr.Dataset]:
    """Arrested events of every point, from the kept profiles."""
    found = []
    for i, plan in enumerate(study.plans):
        profiles = {
            name: result[name].values.reshape(-1, *result[name].shape[-2:])[i] for name in names
        }
        found.append(st.equilibrium_events(plan.problem, profiles))
    return found


def sizes(axes: Axes, events: xr.Dataset, samples: int, index: int, label: str) -> None:
    """How many events a sample are larger than so much."""
    moment = np.sort(events["moment"].values)[::-1]
    if moment.size:
        count = np.arange(1, moment.size + 1) / samples
        axes.loglog(moment, count, label=label, drawstyle="steps-post", **series(index))


def longest(study: st.Study, events: list[xr.Dataset]) -> str:
    """Length of the longest arrested patch in nucleation lengths."""
    found = max((float(each["length"].max()) for each in events if each.sizes["event"]), default=0)
    return f"{found / study.plans[0].problem.nucleation_length:.1f}"
