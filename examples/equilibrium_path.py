"""Patches grow, merge and become unstable: the exact path of equilibria of one random interface.

One sample at xi_0/h_n = 0.25. The upper part shows where the interface slips as the load rises, up
to the critical load; the lower part the strength, the stress at onset, and the sensitivity, the
share that each node has in the critical load.
Run: python examples/equilibrium_path.py [folder for the figure]
"""

import sys
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import stiction as st
from stiction.plot.style import ACCENT, COLUMN, paper_style


def compute(nodes: int = 1024, sample: int = 0) -> tuple[np.ndarray, xr.Dataset, xr.Dataset]:
    """Strength, onset with sensitivity, and the path at 200 loads up to it."""
    problem = st.paper.problem(nodes=nodes, plane="stress")
    field = st.paper.strength(problem, correlation_ratio=0.25)
    tau_p = field.sample(problem.interface, samples=1, first=sample, seed=1)[0]
    onset = st.onset(problem, tau_p, method=st.Equilibrium(sensitivity=True)).isel(sample=0)
    onset_load = onset.critical_load.item()
    # Most happens close to onset: loads at cubically shrinking distances from it.
    distance = np.linspace(1.0, 0.0, 200) ** 3
    loads = onset_load - (onset_load - tau_p.min()) * distance
    loads[-1] = onset_load * (1.0 - 1e-9)
    return tau_p, onset, st.equilibrium_path(problem, tau_p, loads)


def draw(folder: Path, tau_p: np.ndarray, onset: xr.Dataset, path: xr.Dataset) -> None:
    """Slip over position and load; strength, stress and sensitivity over position."""
    x = path.x.values * 1e3
    with paper_style():
        figure = Figure(figsize=(COLUMN * 2.0, 4.2))
        upper, lower = figure.subplots(2, 1, sharex=True)
        slip = np.ma.masked_less_equal(path.slip.values * 1e6, 0.0)
        colours = upper.pcolormesh(x, path["load"].values / 1e6, slip, shading="nearest")
        upper.axvline(onset.critical_position.item() * 1e3, color="0.6", linewidth=0.5)
        upper.set_ylabel("load (MPa)")
        figure.colorbar(colours, ax=[upper, lower], label="slip (µm)")
        lower.plot(x, tau_p / 1e6, color="0.7", linewidth=0.7, label="strength")
        lower.plot(x, path.stress.values[-1] / 1e6, color="k", linewidth=0.9, label="stress")
        share = onset.sensitivity.values
        base = 0.3 + 0.0 * x
        top = base + 0.3 * share / share.max()
        lower.fill_between(x, base, top, color=ACCENT, lw=0.0, label="sensitivity")
        lower.set(xlabel="position (mm)", ylabel="MPa")
        lower.legend(ncols=3)
        figure.savefig(folder / "equilibrium_path.png", dpi=150)


def main() -> None:
    folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
    tau_p, onset, path = compute()
    slipping = (path.slip.values > 0.0).mean(axis=1)
    print(f"critical stress {onset.critical_stress.item() / 1e6:.4f} MPa, by")
    print(f"{onset.slip_patches.item()} patches on {slipping[-1]:.0%} of the interface;")
    print(f"certified to {onset.certificate_gap.item():.1e} Pa")
    draw(folder, tau_p, onset, path)


if __name__ == "__main__":
    main()
