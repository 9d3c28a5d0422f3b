"""Failure probability: the curve over decades."""

from contextlib import suppress

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from stiction.base.errors import InputError
from stiction.base.model import Positive, Real, checked
from stiction.base.units import in_words, unit_for
from stiction.plot.axes import (
    add_friction_scale,
    add_scale,
    need,
    on_axes,
    problem_of,
    with_unit,
)
from stiction.plot.style import ACCENT, BAND, INK, PALE, QUIET
from stiction.reliability.answer import bounded

TINY = 1e-300
"""Probability that stands for none on a logarithmic scale."""


@checked
def failure_curve(
    curve: xr.Dataset,
    *,
    stress: Real | None = None,
    force: Positive | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw P(onset < s) over decades, with its interval.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    stress : float, optional
        Demand, Pa: the mean shear stress to carry. It is marked, with its probability.
    force : float, optional
        Instead of `stress`: demand, N.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        At the top are forces where the area of the interface is known, else friction
        coefficients if there is a normal pressure. A dotted line marks the lower bound of the
        strength. Of a list of equally likely interfaces the line is their mean, and a wider band
        holds 90 % of them.

    Raises
    ------
    InputError
        If the dataset is not a failure curve, or the area of a force is not known.
    """
    need(curve, "stress", "probability", "probability_low", "probability_high")
    curve = curve.isel(point=np.isfinite(curve["stress"].values))
    bound, chance = float(curve.attrs["lower_bound"]), curve["probability"].values
    factor, unit = unit_for("Pa", curve["stress"].values)
    x = curve["stress"].values * factor
    area = float(curve["force"][0] / curve["stress"][0]) if "force" in curve else None
    if force is not None:
        if area is None or stress is not None:
            raise InputError(
                "force: give force or stress; a force needs a curve of an interface whose area is"
                " known: Blocks(thickness=...), or Interface(width=...) of a line"
            )
        stress, shown = force / area, in_words("N", force)
    elif stress is not None:
        shown = f"{stress * factor:.4g} {unit}"
    with on_axes(ax) as axes:
        if bounded(bound):
            axes.axvline(bound * factor, color=QUIET, linewidth=0.7, linestyle=":")
        text = "subset simulation, 95 % interval"
        if "members" in curve:
            ends = (np.maximum(curve[name].values, TINY) for name in ("band_low", "band_high"))
            label = f"90 % of {curve.sizes['member']} equally likely interfaces"
            axes.fill_between(x, *ends, color=BAND, linewidth=0.0, label=label)
            text = "their mean, 95 % interval of sampling"
        low, high = curve["probability_low"].values, curve["probability_high"].values
        axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
        axes.plot(x, chance, "o-", color=INK, markersize=2.5, linewidth=0.9, label=text)
        if stress is not None:
            text = f"demand: {shown}"
            if x[-1] <= stress * factor <= x[0]:
                there = np.interp(stress * factor, x[::-1], np.log(chance[::-1]))
                text += f", P = {np.exp(there):.2g}"
            axes.axvline(stress * factor, color=ACCENT, linewidth=0.9, label=text)
        axes.set_yscale("log")
        axes.set_ylim(0.5 * float(chance.min()), 1.0)
        axes.set_xlabel(f"stress $s$ ({unit})")
        axes.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        if area is not None:
            scale, name = unit_for("N", x / factor * area)
            add_scale(axes, "x", area * scale / factor, with_unit("shear force", name))
        else:
            with suppress(InputError):  # a problem that exists in Python only: stresses alone
                add_friction_scale(axes, problem_of(curve), "x", factor)
        axes.legend(loc="lower right")
    return axes
