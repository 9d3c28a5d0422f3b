"""What is computed: each study is a function of a runner and returns a labelled dataset."""

import dataclasses
import functools
import math

import numpy as np
import xarray as xr

import stiction as st
from reproduction import PARAMETERS, setting
from reproduction.runner import Runner, Size, along, kept
from reproduction.setting import FIRST, MEAN, PROBLEM, RATIOS, SIMULATED, STRAIN, H, strength

LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
RUPTURE = st.Rupture(loading_rate=setting.LOADING_RATE)
CELLS = 2048
NORMAL = np.linspace(-2.0, 2.0, 17)
"""Places in standard deviations at which tau_n is compared with a normal distribution."""
TREND = (0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
WINDOWS = (2.0, 4.0, 8.0, 16.0)
LOAD_SHARES = (0.88, 0.90, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99, 0.995, 0.999)
RATES = (0.1, 0.3, 1.0, 3.0, 10.0)
READINGS = {
    "a": "plane stress throughout",
    "b": "plane strain throughout",
    "c": "plane-stress simulations, printed modulus in the prediction and in xi_0/h_n",
    "c'": "plane-stress simulations, printed modulus in the prediction only",
}


def local(run: Runner) -> xr.Dataset:
    """Onsets by the local criterion."""
    return run.sweep("local", PROBLEM, strength, LOCAL, run.size.samples)


def exact(run: Runner) -> xr.Dataset:
    """Onsets by exact equilibrium, with every interaction between patches."""
    return run.sweep("exact", PROBLEM, strength, EXACT, run.size.samples)


def printed(run: Runner) -> xr.Dataset:
    """Onsets by the local criterion with the printed modulus."""
    return run.sweep("printed", STRAIN, strength, LOCAL, run.size.readings, SIMULATED)


def ruptures(run: Runner) -> xr.Dataset:
    """Ruptures of the first samples, until the whole interface slides."""
    return run.sweep("ruptures", PROBLEM, strength, RUPTURE, run.size.ruptures, SIMULATED)


def dynamic(run: Runner) -> xr.Dataset:
    """Monte Carlo study by ruptures."""
    return run.sweep("dynamic", PROBLEM, strength, RUPTURE, run.size.dynamic)


@kept(samples=lambda size: size.samples)
def moments(run: Runner, samples: int) -> xr.Dataset:
    """Nucleation stress: weakest point, moments, histogram, and the bound that the grid has."""
    interface = PROBLEM.interface
    weights = setting.discrete_weights()
    kernel = np.zeros(interface.size)
    kernel[: weights.size] = weights
    transform = np.conj(np.fft.rfft(kernel))
    edges = np.linspace(setting.LOW, setting.HIGH, CELLS + 1)
    spread = {
        r: setting.DEVIATION * variance_ratio(PROBLEM, strength(r)) ** 0.5 for r in RATIOS
    }

    def batch(ratio, first, count):
        seed = run.seed_of(ratio)
        tau_p = strength(ratio).sample(interface, samples=count, seed=seed, first=first)
        tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)
        bound = np.fft.irfft(np.fft.rfft(tau_p, axis=1) * transform, interface.size, axis=1)
        d = tau_n / MEAN - 1.0
        powers = [d.mean(axis=1), (d * d).mean(axis=1), (d * d * d).mean(axis=1)]
        # Least tau_n away from its minimum by more than h_n.
        where = tau_n.argmin(axis=1) * interface.spacing
        near = setting.distance(interface.x[None, :], where[:, None]) < H
        variables = {
            "weakest_strength": tau_p.min(axis=1),
            "weakest_position": tau_p.argmin(axis=1) * interface.spacing,
            "largest_tau_n": tau_n.max(axis=1),
            "second_tau_n": np.where(near, np.inf, tau_n).min(axis=1),
            "least_tau_n": tau_n.min(axis=1),
            "bound": bound.min(axis=1),
        }
        extremes = xr.Dataset({name: ("sample", row) for name, row in variables.items()})
        counts = np.histogram(tau_n[:, ::16], edges)[0]
        limits = [MEAN + level * spread[ratio] for level in NORMAL]
        return extremes.assign(
            below=(("sample", "level"), np.array([(tau_n < s).mean(axis=1) for s in limits]).T),
            powers=(("sample", "order"), np.array(powers).T),
            counts=("cell", counts),
        )

    return run.batches(batch, "correlation_ratio", RATIOS, samples)


@kept()
def theory(run: Runner) -> xr.Dataset:
    """Variance of the nucleation stress by integration, and correlations."""
    interface = PROBLEM.interface
    ratios = np.geomspace(0.02, 20.0, 41)
    usable = ratios[ratios > 0.1]
    parts = [
        xr.Dataset({
            "correlation": ("x", field.correlation(interface)),
            "gaussian_correlation": ("x", field.correlation(interface, of="z")),
            "variance_ratio": variance_ratio(PROBLEM, field),
        })
        for field in map(strength, RATIOS)
    ]  # fmt: skip
    return along("correlation_ratio", RATIOS, parts).assign(
        periodic=("usable", [variance_ratio(PROBLEM, strength(ratio)) for ratio in usable]),
        infinite=("ratio", [infinite_variance_ratio(ratio) for ratio in ratios]),
        ratio=ratios, usable=usable, x=interface.x,
    )  # fmt: skip


def variance_ratio(problem, field) -> float:
    """Return Var[tau_n]/Var[tau_p]."""
    return float(st.theory.nucleation_statistics(problem, field).variance_ratio)


def infinite_variance_ratio(ratio: float) -> float:
    """Return Var[tau_n]/Var[tau_p] on an interface so long that it could be infinite."""
    length = 60.0 * H * max(ratio, 1.0)
    nodes = 2 ** math.ceil(math.log2(length / H * max(16.0, 8.0 / ratio)))
    problem = dataclasses.replace(PROBLEM, interface=st.Interface(length=length, nodes=nodes))
    return variance_ratio(problem, strength(ratio, mean_mode=True))


def readings(run: Runner) -> xr.Dataset:
    """Onsets under four readings of the modulus, for all that is printed and depends on it."""
    count = run.size.readings

    def in_printed(ratio: float):
        return strength(ratio, nucleation_length=setting.PRINTED_H)

    def first(dataset: xr.Dataset) -> xr.Dataset:
        return dataset.sel(correlation_ratio=list(SIMULATED)).isel(sample=slice(count))

    consistent = first(exact(run)), first(local(run))
    strain = run.sweep("strain-exact", STRAIN, in_printed, EXACT, count, SIMULATED)
    strain_local = run.sweep("strain-local", STRAIN, in_printed, LOCAL, count, SIMULATED)
    mixed = run.sweep("mixed-exact", PROBLEM, in_printed, EXACT, count, SIMULATED)
    mixed_own = run.sweep("mixed-local", PROBLEM, in_printed, LOCAL, count, SIMULATED)
    # Of each reading: the simulation, its prediction, the prediction with its own modulus, the
    # strength, and the problem of the prediction.
    cases = {
        "a": (*consistent, consistent[1], strength, PROBLEM),
        "b": (strain, strain_local, strain_local, in_printed, STRAIN),
        "c": (mixed, strain_local, mixed_own, in_printed, STRAIN),
        "c'": (consistent[0], printed(run), consistent[1], strength, STRAIN),
    }
    parts = []
    for simulated, predicted, by_one_modulus, field_of, problem in cases.values():
        stress, place = simulated["first_instability"], simulated["critical_position"]
        length = problem.nucleation_length
        gap = setting.distance(predicted["critical_position"], place)
        least = []  # tau_n at the place of the simulated onset
        for ratio, row in zip(SIMULATED, place.values, strict=True):
            tau_p = field_of(ratio).sample(
                PROBLEM.interface, samples=count, seed=run.seed_of(ratio)
            )
            away = setting.distance(PROBLEM.interface.x[None, :], row[:, None])
            tau_n = st.theory.nucleation_stress(problem, tau_p)
            least.append(np.where(away < 0.5 * length, tau_n, np.inf).min(axis=1))
        parts.append(
            xr.Dataset(
                {
                    "simulated": stress,
                    "predicted": predicted["first_instability"],
                    "excess": predicted["first_instability"] / stress - 1.0,
                    "consistent_excess": by_one_modulus["first_instability"] / stress - 1.0,
                    "misplaced": (("correlation_ratio", "sample"), gap > 0.5 * length),
                    "patches": simulated["slip_patches"],
                    "contest": least / predicted["first_instability"] - 1.0,
                    "helped": least / stress - 1.0,
                    "length": length / setting.L,
                }
            ).drop_vars("sample", errors="ignore")
        )
    return along("reading", list(READINGS), parts)


def _weakened(slip, tau_p, node: int) -> float:
    """Return the share of a rupture at its residual strength once it is 6 h_n long."""
    interface = PROBLEM.interface
    turn = interface.size // 2 - node
    weakened = np.roll((tau_p - setting.residual(tau_p)) / setting.W, turn)
    for row in np.roll(slip, turn, axis=1):
        stopped = np.flatnonzero(row <= 1e-3 * row.max())
        left = stopped[stopped < interface.size // 2].max(initial=-1)
        right = stopped[stopped > interface.size // 2].min(initial=interface.size)
        if (right - left - 1) * interface.spacing >= 6.0 * H:
            inside = slice(left + 1, right)
            return float(np.mean(row[inside] >= 0.999 * weakened[inside]))
    return np.nan


@kept(count=lambda size: 8 if size.few >= 24 else 2)
def representative(run: Runner, count: int) -> xr.Dataset:
    """Ruptures in space and time at the shortest correlation length, the first one whole."""
    ratio, interface = FIRST, PROBLEM.interface

    def rupture(sample):
        tau_p = strength(ratio).sample(interface, seed=run.seed_of(ratio), first=sample)[0]
        save = st.Save(["slip_rate", "slip"], every=6)
        result = st.simulate_rupture(PROBLEM, tau_p, method=RUPTURE, save=save, progress=False)
        slip = result["slip"].values
        node = round(float(result["critical_position"]) / interface.spacing)
        part = xr.Dataset({"weakened": _weakened(slip, tau_p, node)})
        if sample:
            return part
        # The patch around the onset when the mean stress is largest.
        labels = patches(slip[int(result["mean_stress"].argmax())] > 0.0)
        label = labels[node % interface.size]
        length = np.sum(labels == label) * interface.spacing if label >= 0 else np.nan
        return part.assign(
            slip_rate=(("time", "x"), result["slip_rate"].values.astype(np.float32)),
            mean_stress=("time", result["mean_stress"].values),
            critical_position=float(result["critical_position"]),
            patch_length=length,
            strength=("x", tau_p),
            tau_n=("x", np.ravel(st.theory.nucleation_stress(PROBLEM, tau_p))),
        ).assign_coords(time=result["time"].values, x=interface.x)

    first, *rest = run.map(rupture, [(sample,) for sample in range(count)])
    shares = [float(part["weakened"]) for part in (first, *rest)]
    return first.assign(weakened=("rupture", shares))


@kept(count=lambda size: 8 if size.ruptures >= 20 else 2)
def convergence(run: Runner, count: int) -> xr.Dataset:
    """Ruptures with other grids, loading rates and time steps, on the same samples."""
    onset = dataclasses.replace(RUPTURE, stop="onset")
    half = dataclasses.replace(
        onset, courant=onset.courant / 2, load_step=onset.load_step / 2,
        slip_step=onset.slip_step / 2,
    )  # fmt: skip
    cases = {
        f"rate {rate:g}": (
            PROBLEM, dataclasses.replace(onset, loading_rate=rate * setting.LOADING_RATE)
        ) for rate in RATES
    }  # fmt: skip
    cases |= {
        "half the nodes": (setting.grid(PROBLEM, nodes=0.5), onset),
        "twice the nodes": (setting.grid(PROBLEM, nodes=2.0), onset),
        "half the time step": (PROBLEM, half),
    }
    ratio = FIRST

    def onset_of(case, sample):
        problem, method = cases[case]
        names = ("critical_stress", "critical_position", "offset")
        if sample >= 4 and (problem is not PROBLEM or method is half):
            return xr.Dataset(dict.fromkeys(names, np.nan))
        tau_p = strength(ratio).sample(problem.interface, seed=run.seed_of(ratio), first=sample)
        moving = st.onset(problem, tau_p, method=method, progress=False)
        static = st.onset(problem, tau_p, method=EXACT, progress=False)
        stress, place = (float(moving[name][0]) for name in names[:2])
        offset = stress / float(static["first_instability"][0]) - 1.0
        return xr.Dataset(dict(zip(names, (stress, place, offset), strict=True)))

    return run.grid(onset_of, case=list(cases), sample=range(count))


def trend(run: Runner) -> xr.Dataset:
    """Onsets over a wide range of correlation lengths, with L held fixed."""
    study = st.Study(
        problem=PROBLEM,
        random=strength(1.0),
        method=LOCAL,
        ensemble=st.Ensemble(samples=run.size.trend, seed=run.seed),
        sweep=[{"random.strength.spectrum.correlation_length": [r * H for r in TREND]}],
    )
    result = run.study("trend", study).rename(correlation_length="ratio")
    return result[["critical_stress"]].assign_coords(ratio=list(TREND))


@kept(samples=lambda size: size.trend)
def vanishing(run: Runner, samples: int) -> xr.Dataset:
    """Onsets at vanishing correlation length, by the local criterion on a finer grid."""
    fine = setting.grid(PROBLEM, nodes=4.0)

    def batch(ratio, first, count):
        field = strength(ratio)
        tau_p = field.sample(
            fine.interface, samples=count, seed=run.seed_of(ratio), first=first
        )
        least = st.theory.nucleation_stress(fine, tau_p).min(axis=1)
        return xr.Dataset({"stress": ("sample", least)})

    return run.batches(batch, "ratio", (1 / 64, 1 / 32), samples)


@kept(samples=lambda size: size.trend // 2)
def window(run: Runner, samples: int) -> xr.Dataset:
    """Onsets as the nucleation length vanishes, with L/xi_0 held fixed."""
    fine = setting.grid(PROBLEM, nodes=2.0)
    field = strength(setting.LAST)

    def batch(ratio, first, count):
        rate = setting.W * ratio / setting.LAST
        friction = dataclasses.replace(fine.friction, weakening_rate=rate)
        problem = dataclasses.replace(fine, friction=friction)
        tau_p = field.sample(fine.interface, samples=count, seed=run.seed, first=first)
        least = st.theory.nucleation_stress(problem, tau_p).min(axis=1)
        weakest = tau_p.min(axis=1)
        return xr.Dataset({"stress": ("sample", least), "weakest": ("sample", weakest)})

    return run.batches(batch, "ratio", WINDOWS, samples)


@kept()
def modes(run: Runner) -> xr.Dataset:
    """Onsets with rounded weights, with more modes of the strength, and with fewer."""
    parts = []
    for ratio in RATIOS:
        field, interface = strength(ratio), PROBLEM.interface
        spectrum = dataclasses.replace(field.spectrum, truncation=None, power_kept=1.0 - 1e-7)
        more = dataclasses.replace(field, spectrum=spectrum)
        tau_p = field.sample(interface, samples=200, seed=run.seed)
        usual = st.theory.nucleation_stress(PROBLEM, tau_p).min(axis=1)
        cut = np.fft.rfft(tau_p, axis=1)
        t = (np.arange(64) + 0.5) * np.pi / 64  # Eq. 9 at s = cos t, by Gauss's rule
        weight = 0.751 * (0.925 - 0.308 * np.cos(t) ** 2) * np.sin(t) ** 2 * np.pi / 64
        average = weight @ np.cos(0.5 * H * np.outer(np.cos(t), interface.wavenumbers))
        rounded = np.fft.irfft(cut * average, interface.size, axis=1).min(axis=1)
        cut[:, interface.wavenumbers > 10.0 * np.pi / (ratio * H)] = 0.0
        changed = {
            "untruncated": more.sample(interface, samples=200, seed=run.seed),
            "cut": np.fft.irfft(cut, interface.size, axis=1),
        }
        changes = {
            name: st.theory.nucleation_stress(PROBLEM, rows).min(axis=1) / usual - 1.0
            for name, rows in changed.items()
        } | {"rounded": rounded / usual - 1.0}
        parts.append(xr.Dataset({name: ("sample", row) for name, row in changes.items()}))
    return along("correlation_ratio", RATIOS, parts)


def patches(slipping):
    """Return the number of the patch that each node belongs to, -1 where it sticks."""
    starts = slipping & ~np.roll(slipping, 1)
    count = max(int(starts.sum()), 1)
    # Nodes before the first start belong to the last patch, round the corner.
    return np.where(slipping, (np.cumsum(starts) - 1) % count, -1)


@kept(count=lambda size: size.few)
def growth(run: Runner, count: int) -> xr.Dataset:
    """Slip patches that appear, grow and merge while the load rises to the onset."""
    interface = PROBLEM.interface

    def grow(ratio, sample):
        tau_p = strength(ratio).sample(interface, seed=run.seed_of(ratio), first=sample)[0]
        onset = st.onset(PROBLEM, tau_p, method=EXACT, progress=False)
        load = float(onset["first_instability"][0])
        path = st.equilibrium_path(PROBLEM, tau_p, load * np.array(LOAD_SHARES))
        labels = [patches(row > 0.0) for row in np.nan_to_num(path["slip"].values)]
        node = round(float(onset["critical_position"][0]) / interface.spacing) % interface.size
        slipping = np.flatnonzero(labels[-1] >= 0)
        if slipping.size == 0:  # the critical patch begins less than 0.1 % below its onset
            near = setting.distance(tau_p.argmin(), node, interface.size) * interface.spacing
            merged, holds_weakest = False, near < 0.5 * H
        else:
            away = setting.distance(slipping, node, interface.size)
            critical = labels[-1] == labels[-1][slipping[away.argmin()]]
            merged = any(np.unique(row[critical & (row >= 0)]).size > 1 for row in labels[:-1])
            holds_weakest = critical[tau_p.argmin()]
        number = [row.max() + 1 for row in labels]
        return xr.Dataset(
            {"patches": ("level", number), "merged": merged, "holds_weakest": holds_weakest}
        )

    growing = run.grid(grow, correlation_ratio=RATIOS, sample=range(count))
    return growing.assign_coords(level=list(LOAD_SHARES))


def dips(*places):
    """Return the mean strength with smooth dips; places are (centre in h_n, relative depth)."""
    x = (PROBLEM.interface.x - 0.5 * setting.L) / H
    shape = sum(depth * np.exp(-2.0 * ((x - centre) / 0.8) ** 2) for centre, depth in places)
    return MEAN * (1.0 - shape)


@kept()
def mechanism(run: Runner) -> xr.Dataset:
    """Patches that act on each other: one, two, and a pair with a helper."""

    def onset(profile, problem=PROBLEM):
        return st.onset(problem, profile, method=EXACT, progress=False)

    def local_stress(profile):
        return float(st.theory.nucleation_stress(PROBLEM, profile).min())

    result = xr.Dataset(coords={"x": PROBLEM.interface.x})
    dip = dips((0.0, 0.30))
    single = float(onset(dip)["first_instability"][0])
    path = st.equilibrium_path(PROBLEM, dip, [0.999 * single]).isel(load=0)
    result["one_strength"], result["one_stress"] = ("x", dip), ("x", path["stress"].values)
    result["one_load"] = 0.999 * single
    slipping = path["slip"].values > 0.0
    change = path["stress"].values / (0.999 * single) - 1.0
    x = PROBLEM.interface.x - 0.5 * setting.L
    edge = np.abs(x[slipping]).max()
    result["inside"] = change[slipping].mean()
    result["beside"] = np.interp(edge + 0.25 * H, x, change)
    apart = (1.25, 1.5, 2.0, 3.0, 5.0, 8.0)
    lowering = []
    for distance in apart:
        two = dips((-0.5 * distance, 0.30), (0.5 * distance, 0.30))
        stress = float(onset(two)["first_instability"][0])
        # What a single dip misses is no interaction.
        missed = (local_stress(dip) - single) / single
        lowering.append((local_stress(two) - stress) / stress - missed)
    result["lowering"] = ("distance", lowering)
    result = result.assign_coords(distance=list(apart))
    pair = dips((-8.0, 0.30), (6.0, 0.298), (7.5, 0.28))
    tau_n = np.ravel(st.theory.nucleation_stress(PROBLEM, pair))
    result["pair_strength"], result["pair_tau_n"] = ("x", pair), ("x", tau_n)
    result["pair_local"] = PROBLEM.interface.x[tau_n.argmin()]
    result["pair_exact"] = float(onset(pair)["critical_position"][0])
    # Load and strength exchanged: tau_p(x), and max tau_p with an initial stress in its place.
    field, gaps = strength(setting.SECOND), []
    for tau_p in field.sample(PROBLEM.interface, samples=16, seed=run.seed):
        highest = tau_p.max()
        loaded = dataclasses.replace(PROBLEM, load=st.Load(initial_stress=highest - tau_p))
        level = onset(np.full(tau_p.size, highest), loaded)["first_instability"][0]
        usual = float(onset(tau_p)["first_instability"][0])
        gaps.append((float(level) - (highest - tau_p).mean()) / usual - 1.0)
    result["exchange"] = float(np.abs(gaps).max())
    return result


@kept(samples=lambda size: size.samples, most=lambda size: 10)
def arrest(run: Runner, samples: int, most: int) -> xr.Dataset:
    """Arrested samples again, with inertia."""
    events = exact(run)["arrested_events"]
    interface = PROBLEM.interface
    chosen = [
        (ratio, int(number))
        for ratio in RATIOS
        for number in np.flatnonzero(events.sel(correlation_ratio=ratio).values > 0)[:most]
    ]

    def beside(tau_p, centre, length):
        """Largest strength within h_n/2 of each end of a patch; the smaller of the two."""
        sides = []
        for sign in (-1.0, 1.0):
            middle = centre + sign * (0.5 * length + 0.25 * H)
            near = setting.distance(interface.x, middle) <= 0.25 * H
            sides.append(tau_p[near].max())
        return min(sides)

    def again(ratio, number):
        tau_p = strength(ratio).sample(interface, seed=run.seed_of(ratio), first=number)[0]
        static = st.onset(PROBLEM, tau_p, method=st.Equilibrium(events=1), progress=False)
        length = float(static["event_length"][0, 0])
        centre = float(static["event_position"][0, 0])
        at = beside(tau_p, centre, length)
        by_chance = [beside(tau_p, place, length) for place in interface.x[::8]]
        moving = st.onset(PROBLEM, tau_p, method=RUPTURE, progress=False)
        rank = float(np.mean(np.array(by_chance) < at))
        values = (ratio, number, length, rank, float(moving["arrested_events"][0]))
        return xr.Dataset(dict(zip(names, values, strict=True)))

    names = ("ratio", "number", "length", "rank", "dynamic")
    parts = run.map(again, chosen)
    return xr.Dataset({
        name: ("event", [float(part[name]) for part in parts]) for name in names
    })  # fmt: skip


DRIVING = {
    "uniform": st.Load(),
    "gradient": st.Load(profile=st.GradientLoad(amplitude=0.9, centre=0.5)),
    "edge": st.Load(profile=st.EdgeLoad(excess=4.0, decay=0.1 * setting.L, edge=0.5)),
}
"""Loads of the study of non-uniform driving; tau_0 is the mean of each."""


def driven(case: str):
    """Return the problem under one of these loads, with a residual strength of 0.6 tau_p,min."""
    problem = setting.grid(PROBLEM, nodes=0.5)
    friction = dataclasses.replace(problem.friction, residual_strength=0.6 * setting.LOW)
    return dataclasses.replace(problem, friction=friction, load=DRIVING[case])


@kept(count=lambda size: 16 if size.few >= 24 else 4)
def driving(run: Runner, count: int) -> xr.Dataset:
    """Arrested fronts under non-uniform loads, by equilibrium and with inertia."""
    field = strength(setting.SECOND)

    def arrests(case, sample):
        problem = driven(case)
        tau_p = field.sample(problem.interface, seed=run.seed, first=sample)[0]
        static = st.onset(problem, tau_p, method=st.Equilibrium(events=12), progress=False)
        length, stress = static["event_length"].values[0], static["event_stress"].values[0]
        drop = tau_p - problem.friction.residual_strength
        energy = float(np.mean(drop**2)) / (2.0 * setting.W)
        griffith = np.full(length.size, np.nan)
        there = np.isfinite(length)
        if there.any():
            centre = 0.5 * problem.interface.measure
            griffith[there] = st.theory.griffith_length(
                problem, stress[there], energy, centre=centre, arrest=True
            )
        dynamic = np.nan
        if case == "edge" and there[0]:
            dynamic = _held(problem, tau_p, float(stress[0]))
        arrested = {"length": ("event", length), "griffith": ("event", griffith)}
        return xr.Dataset(arrested | {"dynamic_length": dynamic})

    return run.grid(arrests, case=list(DRIVING), sample=range(count))


def _held(problem, tau_p, stress: float) -> float:
    """Return the length of the patch in which a rupture comes to rest under a load that is held
    just above that of the first arrested event, m."""
    rise = 1.005 * stress / setting.LOADING_RATE
    hold = rise + 10.0 * setting.CROSSING
    load = ([0.0, rise, hold], [0.0, 1.005 * stress, 1.005 * stress])
    method = st.Rupture(load=load, stop="rest", end_time=hold)
    rupture = st.simulate_rupture(
        problem, tau_p, method=method, save=st.Save(["slip"], every=1_000_000), progress=False
    )
    slip = rupture["slip"].values[-1]
    labels = patches(slip > 1e-2 * slip.max())
    longest = np.bincount(labels[labels >= 0]).max(initial=0)
    return float(longest) * problem.interface.spacing


@kept(count=lambda size: min(2 * size.what_if, 400))
def free_end(run: Runner, count: int) -> xr.Dataset:
    """Onsets with free ends in mode III, where a mirrored field has them exactly.

    A field mirrored at x = 0 and L makes antiplane displacement even there: no stress acts on
    these planes, as if the solids ended.
    """
    base = dataclasses.replace(PROBLEM, mode="III")
    length = base.nucleation_length
    cases = [(ratio, 1.0) for ratio in RATIOS] + [(FIRST, 0.25), (FIRST, 0.5)]

    def batch(case, first, count):
        ratio, factor = cases[case]
        problem = setting.grid(base, length=factor, nodes=factor)
        double = setting.grid(base, length=2.0 * factor, nodes=2.0 * factor)
        field = strength(ratio, nucleation_length=length)
        tau_p = field.sample(problem.interface, samples=count, seed=run.seed, first=first)
        mirrored = np.concatenate([tau_p, tau_p[:, ::-1]], axis=1)
        periodic = st.onset(problem, tau_p, method=EXACT, progress=False)
        free = st.onset(double, mirrored, method=EXACT, progress=False)
        extent = problem.interface.measure
        # Nodes are half a spacing from the mirror planes.
        place = (free["critical_position"].values + 0.5 * problem.interface.spacing) % extent
        end = np.minimum(place, extent - place) / length
        change = free["first_instability"].values / periodic["first_instability"].values - 1.0
        return xr.Dataset({"change": ("sample", change), "end": ("sample", end)})

    return run.batches(batch, "case", range(len(cases)), count)


@kept()
def failure(run: Runner) -> xr.Dataset:
    """Failure probability down to one in a million at xi_0 = h_n/2, by the local criterion."""
    return st.failure_curve(
        PROBLEM, strength(setting.SECOND), method=LOCAL, smallest=1e-6, target_cv=0.2,
        seed=run.seed, progress=False,
    ).drop_attrs()  # fmt: skip


WHAT_IFS = (
    "wide_strength", "random_residual", "random_load", "normal_load", "length", "exponent",
    "skewness",
)  # fmt: skip
ARRESTS = {"wide_strength": ((3,),), "random_load": ((4, 5),), "random_residual": ((2,), (0,))}
"""What-ifs in which arrest is the question: of each axis, the values that are run with inertia."""
TIMES = {"random_load": 2}
"""Samples by equilibrium, in multiples of the usual number: more where shares are small."""
TIMES_RUPTURES = {"random_residual": 6}
"""Ruptures likewise: one in six is arrested there; of 8, most often fewer than the two needed."""


def what_if(run: Runner, name: str) -> xr.Dataset:
    """A study file of `what_if/`, its swept points stacked along 'point'."""
    study = st.Study.from_toml(setting.WHAT_IF / f"{name}.toml")
    most = run.size.trend
    if study.method != LOCAL:
        most = run.size.what_if * TIMES.get(name, 1)
    ensemble = st.Ensemble(samples=min(most, study.ensemble.samples), seed=run.seed)
    return stacked(run.study(name, dataclasses.replace(study, ensemble=ensemble)))


def stacked(result: xr.Dataset) -> xr.Dataset:
    """Return a dataset with its swept axes stacked along 'point', in the order of the file."""
    swept = [dim for dim in result["critical_stress"].dims if dim != "sample"]
    numbered = result.drop_vars([name for name in result.coords if name != "sample"])
    return numbered.stack(point=swept, create_index=False).transpose("point", ...)


def what_if_dynamic(run: Runner, name: str) -> xr.Dataset:
    """Points of a what-if in which arrest is the question, with inertia; 'point' numbers them."""
    plain = st.Study.from_toml(setting.WHAT_IF / f"{name}.toml").to_dict()
    sizes = [len(next(iter(axis.values()))) for axis in plain["sweep"]]
    numbers = np.arange(math.prod(sizes)).reshape(sizes)[np.ix_(*ARRESTS[name])]
    plain["sweep"] = [
        {key: [values[i] for i in chosen] for key, values in axis.items()}
        for axis, chosen in zip(plain["sweep"], ARRESTS[name], strict=True)
    ]
    plain["method"] = RUPTURE
    samples = min(run.size.arrests * TIMES_RUPTURES.get(name, 1), 200)
    plain["ensemble"] = {"samples": samples, "seed": run.seed}
    result = stacked(run.study(f"{name}-inertia", st.Study.from_dict(plain)))
    return result.assign_coords(point=numbers.ravel())


PAPER = (local, moments, exact, ruptures, theory, representative)
"""What the paper does, in the order in which it is computed."""
MODULUS = (printed, readings)
"""Which modulus the paper used: asked with the paper's parameters only."""
BEYOND = (convergence, trend, vanishing, window, modes, growth, mechanism, arrest, driving,
          free_end, failure)  # fmt: skip
"""What `--full` adds."""


def jobs(size: Size, full: bool):
    """Yield the name, the progress line and the function of every study."""
    studies = PAPER if PARAMETERS else PAPER + MODULUS
    studies += BEYOND if full else ()
    studies += (dynamic,) if full and size.dynamic else ()
    for study in studies:
        yield study.__name__, study.__doc__.partition(".")[0], study
    # The what-ifs state parameters of their own.
    for name in WHAT_IFS if full and not PARAMETERS else ():
        text = f"What if: {name.replace('_', ' ')}"
        yield name, text, functools.partial(what_if, name=name)
        if name in ARRESTS:
            text += ", with inertia"
            yield f"{name}-inertia", text, functools.partial(what_if_dynamic, name=name)
