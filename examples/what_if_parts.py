"""What each what-if study shows: a figure, and three sentences with its numbers."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from what_if_correlation import correlation
from what_if_plots import (
    XI,
    axes_of,
    band,
    events_of,
    lengths,
    logarithmic,
    longest,
    share_of,
    sizes,
    told,
)

import stiction as st
from stiction.plot.style import PALE, color, marker, series

Shown = tuple[Figure, list[str]]
MEGA = 1e-6
TAU = r"$\tau_\mathrm{cr}$ (MPa)"


def skewness(study: st.Study, result: xr.Dataset) -> Shown:
    """The mirrored distribution."""
    figure, (mean, spread) = axes_of(2)
    x, stress = lengths(result), result["critical_stress"].values * MEGA
    for i, label in enumerate(("mostly weak (paper)", "mostly strong")):
        band(mean, x, stress[i], i, label)
        spread.plot(x, 1e3 * stress[i].std(axis=-1), marker=marker(i), **series(i))
    for axes in (mean, spread):
        logarithmic(axes, x, XI)
    mean.set_ylabel(TAU)
    spread.set_ylabel("standard deviation (kPa)")
    spread.set_ylim(bottom=0)
    mean.legend()
    ratio = stress[1].std(axis=-1) / stress[0].std(axis=-1)
    above = (stress[1].mean(axis=-1) - 0.66) / (stress[0].mean(axis=-1) - 0.66)
    low, high, near, far = ratio.argmin(), ratio.argmax(), above.argmin(), above.argmax()
    return figure, [
        f"With few weak regions in a mostly strong interface the critical stress varies"
        f" {told(_wider, stress[:, low])} to {told(_wider, stress[:, high])} times as much"
        " (standard deviations).",
        f"It lies {told(_above, stress[:, near])} to {told(_above, stress[:, far])} times as far"
        " above the lower bound of the strength, which the interface no longer comes close to.",
        f"The trend stays: from the shortest to the longest correlation the mean falls by"
        f" {told(_fall, stress[1])} %, against {told(_fall, stress[0])} % for the distribution of"
        " the paper.",
    ]


def _wider(stress: np.ndarray) -> float:
    return float(stress[1].std() / stress[0].std())


def _above(stress: np.ndarray) -> float:
    return float((stress[1].mean() - 0.66) / (stress[0].mean() - 0.66))


def _fall(stress: np.ndarray) -> float:
    return float(100.0 * (1.0 - stress[-1].mean() / stress[0].mean()))


def exponent(study: st.Study, result: xr.Dataset) -> Shown:
    """Rough and smooth strength of the same memory."""
    figure, (profiles, mean) = axes_of(2)
    values = result["exponent"].values
    x = study.problem.interface.x * 1e3
    near = x < 20.0
    for i in (0, len(values) - 1):
        plan = study.plans[i]
        tau_p = plan.random.strength.sample(plan.problem.interface, samples=1, seed=0)[0] * MEGA
        profiles.plot(x[near], tau_p[near], label=f"exponent {values[i]:g}", **series(i and 2))
    profiles.set_xlabel("$x$ (mm)")
    profiles.set_ylabel(r"$\tau_\mathrm{p}$ (MPa)")
    profiles.legend(loc="upper right")
    stress = result["critical_stress"].values * MEGA
    band(mean, values, stress, 1)
    logarithmic(mean, values, "spectral exponent")
    mean.set_ylabel(TAU)
    usual = int(np.argmin(np.abs(values - 4.0)))
    patches = result["slip_patches"].values

    def shift(rows: np.ndarray) -> float:
        return float(np.abs(rows.mean(axis=-1) / rows[usual].mean() - 1.0).max())

    def width(rows: np.ndarray) -> float:
        return float(np.abs(rows.std(axis=-1) / rows[usual].std() - 1.0).max())

    return figure, [
        f"Between exponents {values[0]:g} and {values[-1]:g} the mean critical stress changes by at"
        f" most {told(shift, stress, scale=100.0)} % of that at {values[usual]:g}: the expected"
        " minor effect.",
        f"Its standard deviation changes by at most {told(width, stress, scale=100.0)} %.",
        f"Rough strength makes more patches, {told(np.mean, patches[0])} at onset against"
        f" {told(np.mean, patches[-1])},"
        " but the moving average over the nucleation length hides them.",
    ]


def length(study: st.Study, result: xr.Dataset) -> Shown:
    """Longer interfaces."""
    figure, (mean, spread) = axes_of(2)
    x, stress = result["length"].values * 1e3, result["critical_stress"].values * MEGA
    band(mean, x, stress, 1)
    deviation = 1e3 * stress.std(axis=-1)
    spread.plot(x, deviation, marker=marker(1), **series(1))
    for axes in (mean, spread):
        logarithmic(axes, x, "length of the interface (mm)")
    mean.set_ylabel(TAU)
    spread.set_ylabel("standard deviation (kPa)")
    spread.set_ylim(bottom=0)

    def slope(rows: np.ndarray) -> float:
        return float(np.polyfit(np.log(x), np.log(rows.std(axis=-1)), 1)[0])

    def step(i: int) -> str:
        return told(lambda rows: 1.0 - rows[i + 1].mean() / rows[i].mean(), stress, scale=100.0)

    doubling = np.diff(stress.mean(axis=-1)) / stress.mean(axis=-1)[:-1]
    return figure, [
        f"A longer interface varies less: {told(np.std, stress[0], scale=1e3)} kPa at {x[0]:g} mm,"
        f" {told(np.std, stress[-1], scale=1e3)} kPa at {x[-1]:g} mm (standard deviations).",
        f"Its standard deviation falls roughly like the power {told(slope, stress)} of the length;"
        " that of an average over the interface would fall like the power \u22120.5.",
        f"The mean falls, too, by {step(int(doubling.argmax()))} to"
        f" {step(int(doubling.argmin()))} % with"
        " each doubling, because a longer interface has more places to be weak in.",
    ]


def normal_load(study: st.Study, result: xr.Dataset) -> Shown:
    """Normal pressure at fixed roughness."""
    figure, (coefficient, patches) = axes_of(2)
    x = result["normal_pressure"].values * MEGA
    mu = result["friction_coefficient"].values
    band(coefficient, x, mu, 1)
    number = result["slip_patches"].values
    band(patches, x, number, 2)
    for axes in (coefficient, patches):
        logarithmic(axes, x, "normal pressure (MPa)")
    coefficient.set_ylabel("static friction coefficient")
    patches.set_ylabel("patches at onset")
    patches.set_ylim(bottom=0)
    shortest = [plan.problem.nucleation_length * 1e3 for plan in study.plans]
    return figure, [
        f"From {x[0]:g} to {x[-1]:g} MPa of pressure the nucleation length shrinks from"
        f" {shortest[0]:.2f} to {shortest[-1]:.2f} mm while the roughness keeps its length, so that"
        " the strength becomes long-ranged by comparison.",
        f"The static friction coefficient falls from {told(np.mean, mu[0])} to"
        f" {told(np.mean, mu[-1])} (by {told(_fall, mu)} %), though every point of the"
        " interface obeys Coulomb's law.",
        f"Its standard deviation goes from {told(np.std, mu[0])} to {told(np.std, mu[-1])}, and"
        f" the number of patches at onset from {told(np.mean, number[0])} to"
        f" {told(np.mean, number[-1])}.",
    ]


def wide_strength(study: st.Study, result: xr.Dataset) -> Shown:
    """Arrest by a wide range of strength."""
    figure, (arrested, stress, size) = axes_of(3)
    factor = (result["high"].values - 0.66e6) / 1e6
    some = (result["arrested_events"].values > 0).mean(axis=-1)
    arrests = result["arrested_events"].values
    arrested.plot(factor, some, marker="o", color=color(1))
    arrested.set_xlabel("range of strength (times)")
    arrested.set_ylabel("share with arrested events")
    arrested.set_ylim(0, 1)
    first, last = (result[key].values * MEGA for key in ("first_instability", "critical_stress"))
    band(stress, factor, first, 1, "first instability")
    band(stress, factor, last, 2, "global sliding")
    stress.set_xlabel("range of strength (times)")
    stress.set_ylabel("stress (MPa)")
    stress.legend(loc="upper left")
    events = events_of(study, result, ("strength",))
    for i, found in enumerate(events):
        sizes(size, found, result.sizes["sample"], i, f"{factor[i]:g}")
    size.set_xlabel("moment of event (N)")
    size.set_ylabel("larger events a sample")
    size.legend(title="range")
    moments = np.concatenate([each["moment"].values for each in events])
    low, high = np.quantile(moments, (0.05, 0.95)) if moments.size else (1.0, 1.0)
    return figure, [
        f"Without inertia {share_of(arrests[0])} of samples have an arrested event with the range"
        f" of the paper, {share_of(arrests[1])} with {factor[1]:g} times and"
        f" {share_of(arrests[-1])} with {factor[-1]:g} times that range: far from slightly more."
        " Inertia carries some of them through; the report of `stiction paper` has shares with it.",
        f"Without inertia {told(np.mean, arrests[-1])} events a sample come first at the widest,"
        f" and global sliding needs {told(_later, last[-1], first[-1])} % more stress than the"
        " first of them: a cascade rather than pre-slip.",
        f"The longest arrested patch, one of"
        f" {sum(each.sizes['event'] for each in events)}, is {longest(study, events)} nucleation"
        f" lengths long, and the moments of nine events of ten lie within a factor of"
        f" {high / low:,.0f}.",
    ]


def _later(last: np.ndarray, first: np.ndarray) -> float:
    return float(100.0 * (last.mean() / first.mean() - 1.0))


def random_load(study: st.Study, result: xr.Dataset) -> Shown:
    """Random initial stress."""
    figure, (stress, arrested) = axes_of(2)
    deviation = result["high"].values / np.sqrt(5.0) * 1e-3
    found = result["critical_stress"].values * MEGA
    band(stress, deviation, found, 1)
    stress.set_ylabel(TAU)
    arrests = result["arrested_events"].values
    some = (arrests > 0).mean(axis=-1)
    arrested.plot(deviation, 100.0 * some, marker="o", color=color(2))
    arrested.set_ylabel("samples with arrested events (%)")
    arrested.set_ylim(0, max(5.0, 110.0 * some.max()))
    for axes in (stress, arrested):
        axes.set_xlabel("standard deviation of the load (kPa)")
    return figure, [
        f"A random initial stress of standard deviation {deviation[0]:.0f} to"
        f" {deviation[-1]:.0f} kPa lowers the mean critical stress from {told(np.mean, found[0])}"
        f" to {told(np.mean, found[-1])} MPa: sliding begins where strength less stress is least.",
        f"Its standard deviation grows from {told(np.std, found[0], scale=1e3)} to"
        f" {told(np.std, found[-1], scale=1e3)} kPa.",
        f"Yet, without inertia, only {share_of(arrests[some.argmin()])} to"
        f" {share_of(arrests[some.argmax()])} of samples have an arrested event,"
        f" {share_of(arrests[-1])} at the strongest disorder of the load: too few to tell these"
        " apart.",
    ]


def random_residual(study: st.Study, result: xr.Dataset) -> Shown:
    """Random stress drop."""
    figure, (arrested, size) = axes_of(2)
    deviation = result["high"].values / (2.0 * np.sqrt(5.0)) * 1e-3
    count = result["arrested_events"].values
    some = (count > 0).mean(axis=-1)
    for i, xi in enumerate(lengths(result)):
        arrested.plot(
            deviation, 100.0 * some[:, i], marker=marker(i), label=rf"$\xi_0$ = {xi:g} mm",
            **series(i),
        )  # fmt: skip
    arrested.set_xlabel("standard deviation of residual strength (kPa)")
    arrested.set_ylabel("samples with arrested events (%)")
    arrested.set_ylim(bottom=0)
    arrested.legend()
    events = events_of(study, result, ("strength", "residual_strength"))
    # The last points of the sweep have the widest residual strength.
    for i, found in enumerate(events[-2:]):
        sizes(size, found, result.sizes["sample"], i, rf"$\xi_0$ = {lengths(result)[i]:g} mm")
    size.set_xlabel("moment of event (N)")
    size.set_ylabel("larger events a sample")
    size.legend()
    first, last = (result[key].values[-1, -1] for key in ("first_instability", "critical_stress"))
    return figure, [
        f"A random residual strength, and with it a random stress drop, arrests without inertia"
        f" {share_of(count[-1, some[-1].argmin()])} to {share_of(count[-1, some[-1].argmax()])} of"
        f" first instabilities at a standard deviation of {deviation[-1]:.0f} kPa, against"
        f" {share_of(count[0, some[0].argmax()])} at {deviation[0]:.0f} kPa.",
        "The first instability hardly notices it, since little has weakened fully by then; global"
        f" sliding comes {told(_later, last, first)} % above it on average.",
        f"At the widest there are {told(np.mean, count[-1])} arrested events a sample, the largest"
        f" {longest(study, events)} nucleation lengths long.",
    ]


def plane(study: st.Study, result: xr.Dataset) -> Shown:
    """Plane stress and plane strain."""
    figure, (stress, gap) = axes_of(2)
    x, found = lengths(result), result["critical_stress"].values * MEGA
    for i, label in enumerate(("plane stress", "plane strain")):
        band(stress, x, found[i], i, label)
    stress.set_ylabel(TAU)
    stress.legend()
    more = 100.0 * (found[1] / found[0] - 1.0)
    band(gap, x, more, 2)
    gap.set_ylabel("plane strain above stress (%)")
    for axes in (stress, gap):
        logarithmic(axes, x, XI)
    modulus = [study.plans[i * x.size].problem.effective_modulus * 1e-9 for i in (0, 1)]
    return figure, [
        f"G* is {modulus[0]:.3f} GPa in plane stress and {modulus[1]:.3f} GPa in plane strain, and"
        " the nucleation length grows in proportion.",
        f"A longer nucleation length averages over more strength: the mean critical stress is"
        f" {told(np.mean, more[0])} % higher at the shortest correlation length and"
        f" {told(np.mean, more[-1])} % at the longest.",
        "This is the size of the error of the printed formula, which takes the modulus of plane"
        " strain for a plane-stress interface.",
    ]


def uniform_dc(study: st.Study, result: xr.Dataset) -> Shown:
    """Uniform d_c instead of a uniform weakening rate."""
    figure, (stress, patch) = axes_of(2)
    x, found = lengths(result), result["critical_stress"].values * MEGA
    unit = study.plans[0].problem.nucleation_length
    critical = result["critical_patch_length"].values / unit
    for i, label in enumerate(("uniform $W$", r"uniform $d_\mathrm{c}$")):
        band(stress, x, found[i], i, label)
        band(patch, x, critical[i], i)
    stress.set_ylabel(TAU)
    stress.legend()
    patch.set_ylabel(r"critical patch$\,/h_\mathrm{n}$")
    patch.set_ylim(bottom=0)
    for axes in (stress, patch):
        logarithmic(axes, x, XI)
    more = 100.0 * (found[1].mean(axis=-1) / found[0].mean(axis=-1) - 1.0)
    longer = np.median(critical[1], axis=-1) / np.median(critical[0], axis=-1)
    return figure, [
        "With uniform d_c weak places weaken slowly, W = (tau_p - tau_r)/d_c, and need a longer"
        f" patch to become unstable: {told(_median, critical[:, longer.argmin()])} to"
        f" {told(_median, critical[:, longer.argmax()])} times as long in the median.",
        f"A longer patch takes in stronger neighbours, so the mean critical stress is"
        f" {told(_more, found[:, more.argmax()])} % higher at most and"
        f" {told(_more, found[:, more.argmin()])} % at least.",
        "There is no single nucleation length then, so that the local criterion does not apply;"
        " equilibrium takes any W(x).",
    ]


def _median(critical: np.ndarray) -> float:
    return float(np.median(critical[1]) / np.median(critical[0]))


def _more(stress: np.ndarray) -> float:
    return float(100.0 * (stress[1].mean() / stress[0].mean() - 1.0))


def free_end(study: st.Study, result: xr.Dataset) -> Shown:
    """Free ends by a mirrored field."""
    figure, (gap, place) = axes_of(2)
    x, changes, ends = lengths(result), [], []
    for i, plan in enumerate(study.plans):
        problem, tau_p = plan.problem, result["strength"].values[i]
        span, nodes = problem.interface.length, problem.interface.nodes
        double = st.Problem(
            problem.solid, st.Interface(length=2.0 * span, nodes=2 * nodes), problem.friction,
            problem.load, mode="III",
        )  # fmt: skip
        mirrored = np.concatenate([tau_p, tau_p[:, ::-1]], axis=1)
        free = st.onset(double, mirrored, method=st.Equilibrium())
        changes.append(
            100.0 * (free["critical_stress"].values / result["critical_stress"].values[i] - 1.0)
        )
        at = np.mod(free["critical_position"].values + 0.5 * problem.interface.spacing, span)
        ends.append(np.minimum(at, span - at) / problem.nucleation_length)
    band(gap, x, np.array(changes), 1)
    gap.axhline(0.0, color=PALE, linewidth=0.8, zorder=0)
    gap.set_ylabel("free ends against periodic (%)")
    logarithmic(gap, x, XI)
    edges = np.linspace(0.0, 4.0, 9)
    unit = study.plans[0].problem.nucleation_length
    chance = 2.0 * unit / study.problem.interface.length
    for i in (0, len(ends) - 1):
        density = np.histogram(ends[i], edges)[0] / (ends[i].size * np.diff(edges))
        place.stairs(density / chance, edges, color=color(i), label=rf"$\xi_0$ = {x[i]:g} mm")
    place.axhline(1.0, color=PALE, linewidth=0.8, zorder=0)
    place.set_xlabel(r"distance of onset from the end$\,/h_\mathrm{n}$")
    place.set_ylabel("onsets, relative to chance")
    place.legend()

    def near(i: int) -> str:
        return told(lambda each: (each < 0.5).mean() / (0.5 * chance), ends[i])

    return figure, [
        "In mode III a field mirrored at both ends leaves the mirror planes free of stress, so an"
        " interface with free ends can be had exactly.",
        f"Free ends lower the mean critical stress, but little: by"
        f" {told(np.mean, -changes[0])} % at the shortest and {told(np.mean, -changes[-1])} % at"
        " the longest correlation length.",
        f"Onsets within half a nucleation length of an end are {near(0)} times as frequent as"
        f" elsewhere at the shortest correlation length, {near(-1)} times at the longest: an"
        " end needs only half a patch.",
    ]


KEPT = ("strength",)
PARTS: dict[str, tuple[Callable[[st.Study, xr.Dataset], Shown], tuple[str, ...]]] = {
    "skewness": (skewness, ()),
    "exponent": (exponent, ()),
    "length": (length, ()),
    "normal_load": (normal_load, ()),
    "wide_strength": (wide_strength, KEPT),
    "random_load": (random_load, ()),
    "random_residual": (random_residual, (*KEPT, "residual_strength")),
    "correlation": (correlation, (*KEPT, "residual_strength")),
    "plane": (plane, ()),
    "uniform_dc": (uniform_dc, ()),
    "free_end": (free_end, KEPT),
}
"""What to draw of each study, and what it keeps along the interface for that."""
