"""The picture of the README: the Monte Carlo study.

Run it with ``python examples/pictures.py [folder]``; it takes about half a minute.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

import stiction as st
from stiction import statistics
from stiction.plot.style import INK, PAGE, PALE, QUIET, color, paper_style

RATIOS = (0.25, 0.5, 1.0, 2.0)
PIXELS = 1400


def main(
    folder: str | Path = "docs/images", samples: int = 10_000, nodes: int = 1024
) -> list[float]:
    """Draw it; return the median critical stress at the ends of the range, MPa."""
    folder = Path(folder)
    problem = st.paper.problem(nodes=nodes)
    onsets, profiles = {}, {}
    for ratio in RATIOS:
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        onsets[ratio] = st.monte_carlo(
            problem, strength, method=st.LocalCriterion(), samples=samples, seed=0
        )
        profiles[ratio] = strength.sample(problem.interface, samples=min(samples, 2000), seed=0)
    save(monte_carlo(problem, onsets, profiles), folder / "monte_carlo.png")
    return [1e-6 * float(onsets[ratio].critical_stress.median()) for ratio in RATIOS[::3]]


def save(figure: Figure, path: Path) -> None:
    """With 1400 pixels across, and a palette instead of true colour, to keep it small."""
    with paper_style():
        figure.savefig(path, dpi=PIXELS / figure.get_figwidth())
    picture = Image.open(path).convert("RGB").quantize(240, dither=Image.Dither.NONE)
    picture.save(path, optimize=True)


def monte_carlo(
    problem: st.Problem, onsets: dict[float, xr.Dataset], profiles: dict[float, Any]
) -> Figure:
    """Strength and nucleation stress of the same draws, and the densities behind them."""
    x = problem.interface.x / problem.interface.length
    with paper_style():
        figure = Figure(figsize=(PAGE, 3.9))
        grid = figure.add_gridspec(2, 3, width_ratios=(2.6, 0.75, 1.35))
        above = figure.add_subplot(grid[0, 0])
        below = figure.add_subplot(grid[1, 0], sharex=above, sharey=above)
        beside = [figure.add_subplot(grid[row, 1], sharey=above) for row in (0, 1)]
        onset = figure.add_subplot(grid[:, 2])
        for i, ratio in enumerate(RATIOS):
            style: dict[str, Any] = {"color": color(i), "linewidth": 1.0}
            tau_p = profiles[ratio] * 1e-6
            tau_n = st.theory.nucleation_stress(problem, profiles[ratio]) * 1e-6
            above.plot(x, tau_p[0], **style)
            below.plot(x, tau_n[0], **style)
            lowest = int(tau_n[0].argmin())
            below.plot(x[lowest], tau_n[0, lowest], "o", color=color(i), markersize=3.5)
            _density(beside[1], tau_n[:, ::16].ravel(), i)
            estimate = statistics.density(
                onsets[ratio].critical_stress.values * 1e-6, bounds=(0.66, 1.66)
            )
            seen = estimate.value > 2e-3 * estimate.value.max()
            values, height = estimate.value[seen], estimate.x[seen]
            onset.fill_betweenx(height, 0, values, color=color(i), alpha=0.18, linewidth=0)
            label = rf"$\xi_0/h_\mathrm{{n}} = {ratio:g}$"
            onset.plot(values, height, label=label, **style)
        strength = st.Beta(alpha=1.5, beta=3.0, low=0.66, high=1.66).distribution
        y = np.linspace(0.63, 1.69, 300)
        beside[0].fill_betweenx(y, 0, strength.pdf(y), color=QUIET, alpha=0.2, linewidth=0)
        beside[0].plot(strength.pdf(y), y, color=INK, linewidth=1.0)
        for axes in (above, below, *beside, onset):
            axes.axhline(0.66, color=QUIET, linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)
        for axes in (above, below):
            axes.axhline(strength.mean(), color=PALE, linewidth=0.7, zorder=0)
        above.set(ylabel="peak strength (MPa)", xlim=(0, 1), ylim=(0.63, 1.69))
        below.set(ylabel="nucleation stress (MPa)", xlabel="position $x/L$")
        above.tick_params(labelbottom=False)
        for axes, name in zip(beside, "pn", strict=True):
            axes.set(xlim=(0, None), xlabel=rf"density $f(\tau_\mathrm{{{name}}})$")
            axes.tick_params(labelleft=False, labelbottom=False, bottom=False)
        onset.set(xlim=(0, None), xlabel=r"density $f(\tau_\mathrm{cr})$")
        onset.set(ylim=(0.655, 0.84), ylabel=r"critical stress $\tau_\mathrm{cr}$ (MPa)")
        onset.tick_params(labelbottom=False, bottom=False)
        onset.legend(loc="upper right")
    return figure


def _density(axes: Axes, values: Any, index: int) -> None:
    estimate = statistics.density(values, bounds=(0.66, 1.66))
    axes.plot(estimate.value, estimate.x, color=color(index), linewidth=1.0)


if __name__ == "__main__":
    short, long = main(sys.argv[1] if len(sys.argv) > 1 else "docs/images")
    print(f"median critical stress: {short:.4f} MPa at xi_0/h_n = 0.25, {long:.4f} MPa at 2")
