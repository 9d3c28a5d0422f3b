"""Figure 3: a representative rupture in space and time."""

from __future__ import annotations

from matplotlib.figure import Figure

from stiction.papers.albertini2020.data import Data
from stiction.report.rupture_figures import rupture_figure
from stiction.report.tables import Table

name = "rupture"
number = "3"
title = "A representative rupture"
needs: tuple[str, ...] = ("representative",)


def caption(data: Data) -> str:
    """What is seen."""
    run = data["representative"]
    peak, place = float(run["critical_stress"]), float(run["critical_position"])
    length = data.setting.problem.interface.extent
    return (
        f"(a) Peak strength at xi_0/h_n = {run.attrs['correlation_ratio']:g}, and the nucleation"
        " length. (b) Slip rate along the interface around the onset, at T; what sticks is white."
        f" The dot marks the onset at x/L = {place / length:.3f}. (c) The same from the first slip"
        " on, with (d) the mean stress on the interface, which is the load while the interface"
        f" creeps; its maximum is tau_cr = {peak * 1e-6:.4f} MPa."
    )


def tables(data: Data) -> list[Table]:
    """Mean stress against time, and the numbers of the run."""
    run = data["representative"]
    record = zip(
        run["step_time"].values.tolist(), run["step_mean_stress"].values.tolist(), strict=True
    )
    scalars = [
        (str(run[key].attrs.get("long_name", key)), float(run[key]), str(run[key].attrs["units"]))
        for key in run.data_vars
        if run[key].ndim == 0 and "units" in run[key].attrs
    ]
    return [
        Table.of("figure-3-run", "The run in numbers", ("what", "value", "unit"), scalars),
        Table.of(
            "figure-3-history", "Mean stress against time", ("t (s)", "mean stress (Pa)"), record
        ),
    ]


def draw(data: Data) -> Figure:
    """As for any other rupture."""
    return rupture_figure(data["representative"], data.setting.problem)
