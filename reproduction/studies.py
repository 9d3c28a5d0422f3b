"""What is computed: each study is a function of a runner and returns a labelled dataset."""

import dataclasses
import functools
import math

import numpy as np
import xarray as xr

import stiction as st
from reproduction import PARAMETERS, TEXTS, setting
from reproduction.runner import Runner, along, kept
from reproduction.setting import FIRST, MEAN, PROBLEM, RATIOS, SIMULATED, STRAIN, H, strength

LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()
RUPTURE = st.Rupture(loading_rate=setting.LOADING_RATE)
CELLS = 2048
NORMAL = np.linspace(-2.0, 2.0, 17)
"""Places in standard deviations at which tau_n is compared with a normal distribution."""
TREND = (0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
WINDOWS = (2.0, 4.0, 8.0, 16.0)
LOAD_SHARES = (0.88, 0.90, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99, 0.995, 0.999)
READINGS = TEXTS["reading"]  # the interpretations of the modulus, by their letters
SWEEPS = {
    "local": ("Onsets by the local criterion", PROBLEM, LOCAL, "samples", RATIOS),
    "exact": ("Onsets by exact equilibrium, with interaction", PROBLEM, EXACT, "samples", RATIOS),
    "ruptures": ("Ruptures until all slides", PROBLEM, RUPTURE, "ruptures", SIMULATED),
    "printed": ("Onsets by the printed modulus", STRAIN, LOCAL, "readings", SIMULATED),
    "dynamic": ("Monte Carlo study by ruptures", PROBLEM, RUPTURE, "dynamic", RATIOS),
    "vanishing": ("Onsets at vanishing correlation length, by the local criterion",
                  setting.grid(PROBLEM, nodes=4.0), LOCAL, "trend", (1 / 64, 1 / 32)),
}  # fmt: skip
"""Progress line, problem, method, number of samples and xi_0/h_n of Monte Carlo studies."""


def sweep(run: Runner, name: str) -> xr.Dataset:
    """Run one of these studies."""
    _, problem, method, count, ratios = SWEEPS[name]
    return run.sweep(name, problem, strength, method, getattr(run.size, count), ratios)


@kept(samples=lambda size: size.samples)
def moments(run: Runner, samples: int) -> xr.Dataset:
    """Nucleation stress: weakest point, moments and histogram."""
    interface = PROBLEM.interface
    edges = np.linspace(setting.LOW, setting.HIGH, CELLS + 1)
    variances = {ratio: variance_ratio(PROBLEM, strength(ratio)) for ratio in RATIOS}

    def batch(ratio, first, count):
        seed = run.seed_of(ratio)
        tau_p = strength(ratio).sample(interface, samples=count, seed=seed, first=first)
        tau_n = st.theory.nucleation_stress(PROBLEM, tau_p)
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
        }
        extremes = xr.Dataset({name: ("sample", row) for name, row in variables.items()})
        counts = np.histogram(tau_n[:, ::16], edges)[0]
        spread = setting.DEVIATION * variances[ratio] ** 0.5
        limits = [MEAN + level * spread for level in NORMAL]
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
    count, interface = run.size.readings, PROBLEM.interface

    def in_printed(ratio: float):
        return strength(ratio, nucleation_length=setting.PRINTED_H)

    def first(dataset: xr.Dataset) -> xr.Dataset:
        return dataset.sel(correlation_ratio=list(SIMULATED)).isel(sample=slice(count))

    consistent = first(sweep(run, "exact")), first(sweep(run, "local"))
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
        "c'": (consistent[0], sweep(run, "printed"), consistent[1], strength, STRAIN),
    }
    parts = []
    for simulated, predicted, by_one_modulus, field_of, problem in cases.values():
        stress, place = simulated["first_instability"], simulated["critical_position"]
        length = problem.nucleation_length
        gap = setting.distance(predicted["critical_position"], place)
        least = []  # tau_n at the place of the simulated onset
        for ratio, row in zip(SIMULATED, place.values, strict=True):
            tau_p = field_of(ratio).sample(interface, samples=count, seed=run.seed_of(ratio))
            away = setting.distance(interface.x[None, :], row[:, None])
            tau_n = st.theory.nucleation_stress(problem, tau_p)
            least.append(np.where(away < 0.5 * length, tau_n, np.inf).min(axis=1))
        variables = {
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
        parts.append(xr.Dataset(variables).drop_vars("sample", errors="ignore"))
    return along("reading", list(READINGS), parts)


@kept()
def representative(run: Runner) -> xr.Dataset:
    """One rupture in space and time at the shortest correlation length."""
    interface = PROBLEM.interface
    tau_p = strength(FIRST).sample(interface, seed=run.seed_of(FIRST))[0]
    save = st.Save(["slip_rate", "slip"], every=6)
    result = st.simulate_rupture(PROBLEM, tau_p, method=RUPTURE, save=save, progress=False)
    # The patch around the onset when the mean stress is largest.
    slip = result["slip"].values[int(result["mean_stress"].argmax())]
    node = round(float(result["critical_position"]) / interface.spacing) % interface.size
    labels = patches(slip > 0.0)
    length = np.sum(labels == labels[node]) if labels[node] >= 0 else np.nan
    return xr.Dataset(
        {
            "slip_rate": (("time", "x"), result["slip_rate"].values.astype(np.float32)),
            "mean_stress": ("time", result["mean_stress"].values),
            "critical_position": float(result["critical_position"]),
            "patch_length": length * interface.spacing,
            "strength": ("x", tau_p),
            "tau_n": ("x", np.ravel(st.theory.nucleation_stress(PROBLEM, tau_p))),
        },
        coords={"time": result["time"].values, "x": interface.x},
    )


def trend(run: Runner) -> xr.Dataset:
    """Onsets over a wide range of correlation lengths, with L held fixed."""
    study = st.Study(
        problem=PROBLEM,
        random=strength(1.0),
        method=LOCAL,
        samples=run.size.trend,
        seed=run.seed,
        sweep=[{"random.strength.spectrum.correlation_length": [r * H for r in TREND]}],
    )
    result = run.study("trend", study).rename(correlation_length="ratio")
    return result[["critical_stress"]].assign_coords(ratio=list(TREND))


@kept(samples=lambda size: size.trend // 2)
def window(run: Runner, samples: int) -> xr.Dataset:
    """Onsets as the nucleation length vanishes, with L/xi_0 held fixed."""
    fine = setting.grid(PROBLEM, nodes=2.0)
    field = strength(setting.LAST)

    def batch(ratio, first, count):
        weakening_rate = setting.W * ratio / setting.LAST
        friction = dataclasses.replace(fine.friction, weakening_rate=weakening_rate)
        problem = dataclasses.replace(fine, friction=friction)
        tau_p = field.sample(fine.interface, samples=count, seed=run.seed, first=first)
        least = st.theory.nucleation_stress(problem, tau_p).min(axis=1)
        weakest = tau_p.min(axis=1)
        return xr.Dataset({"stress": ("sample", least), "weakest": ("sample", weakest)})

    return run.batches(batch, "ratio", WINDOWS, samples)


@kept()
def modes(run: Runner) -> xr.Dataset:
    """Onsets with rounded weights, and with more modes of the strength."""
    parts = []
    for ratio in RATIOS:
        field, interface = strength(ratio), PROBLEM.interface
        spectrum = dataclasses.replace(field.spectrum, power_kept=1.0 - 1e-7)
        more = dataclasses.replace(field, spectrum=spectrum)
        tau_p = field.sample(interface, samples=200, seed=run.seed)
        usual = st.theory.nucleation_stress(PROBLEM, tau_p).min(axis=1)
        t = (np.arange(64) + 0.5) * np.pi / 64  # Eq. 9 at s = cos t, by Gauss's rule
        weight = 0.751 * (0.925 - 0.308 * np.cos(t) ** 2) * np.sin(t) ** 2 * np.pi / 64
        average = weight @ np.cos(0.5 * H * np.outer(np.cos(t), interface.wavenumbers))
        averages = np.fft.irfft(np.fft.rfft(tau_p, axis=1) * average, interface.size, axis=1)
        more_modes = more.sample(interface, samples=200, seed=run.seed)
        untruncated = st.theory.nucleation_stress(PROBLEM, more_modes).min(axis=1)
        rows = {"untruncated": untruncated, "rounded": averages.min(axis=1)}
        changes = {name: ("sample", row / usual - 1.0) for name, row in rows.items()}
        parts.append(xr.Dataset(changes))
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
        row = {"patches": ("level", number), "merged": merged, "holds_weakest": holds_weakest}
        return xr.Dataset(row)

    growing = run.grid(grow, correlation_ratio=RATIOS, sample=range(count))
    return growing.assign_coords(level=list(LOAD_SHARES))


def dips(*places):
    """Return the mean strength with smooth dips; places are (centre in h_n, relative depth)."""
    x = (PROBLEM.interface.x - 0.5 * setting.L) / H
    shape = sum(depth * np.exp(-2.0 * ((x - centre) / 0.8) ** 2) for centre, depth in places)
    return MEAN * (1.0 - shape)


@kept()
def mechanism(run: Runner) -> xr.Dataset:
    """Patches that act on each other: one, and two at a distance."""

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
    events, interface = sweep(run, "exact")["arrested_events"], PROBLEM.interface
    chosen = [
        (ratio, int(number))
        for ratio in RATIOS
        for number in np.flatnonzero(events.sel(correlation_ratio=ratio).values > 0)[:most]
    ]

    def again(ratio, number):
        tau_p = strength(ratio).sample(interface, seed=run.seed_of(ratio), first=number)[0]
        static = st.onset(PROBLEM, tau_p, method=st.Equilibrium(events=1), progress=False)
        moving = st.onset(PROBLEM, tau_p, method=RUPTURE, progress=False)
        length, count = static["event_length"].values[0, 0], moving["arrested_events"].values[0]
        return xr.Dataset({"length": length, "dynamic": count})

    parts = run.map(again, chosen)
    rows = {name: [float(part[name]) for part in parts] for name in ("length", "dynamic")}
    return xr.Dataset({name: ("event", row) for name, row in rows.items()})


DRIVING = {
    "uniform": np.ones_like,
    "gradient": lambda away: 1.0 + 0.9 * (1.0 - 4.0 * away),
    "edge": lambda away: 1.0 + 4.0 * np.exp(-away / 0.1),
}
"""Load profiles over the distance from the middle, as a share of the length."""


def driven(case: str):
    """Return the problem under one of these loads, with a residual strength of 0.6 tau_p,min."""
    problem = setting.grid(PROBLEM, nodes=0.5)
    friction = dataclasses.replace(problem.friction, residual_strength=0.6 * setting.LOW)
    x = problem.interface.x / problem.interface.length
    profile = DRIVING[case](np.abs(x - 0.5))
    load = st.Load(profile=profile / profile.mean())  # tau_0 is the mean
    return dataclasses.replace(problem, friction=friction, load=load)


def driving(run: Runner) -> xr.Dataset:
    """Arrested fronts under non-uniform loads, by equilibrium and with inertia."""
    count = 16 if run.size.few >= 24 else 4
    parts = []
    for case in DRIVING:
        problem = driven(case)
        residual = problem.friction.residual_strength
        energy = setting.MARGINAL.distribution.expect(lambda s, r=residual: (s - r) ** 2)
        study = st.Study(problem=problem, random=strength(setting.SECOND),
                         method=st.Equilibrium(events=12),
                         samples=count, seed=run.seed)  # fmt: skip
        events = run.study(f"driving-{case}", study)[["event_length", "event_stress"]]
        stress = events["event_stress"].values
        griffith = np.full(stress.shape, np.nan)
        if (there := np.isfinite(stress)).any():
            griffith[there] = st.theory.griffith_length(
                problem, stress[there], energy / (2.0 * setting.W),
                centre=0.5 * problem.interface.measure, arrest=True,
            )  # fmt: skip
        parts.append(events.assign(griffith=(("sample", "event"), griffith)))
    return along("case", list(DRIVING), parts).assign(dynamic_length=held(run)["length"])


@kept(count=lambda size: 16 if size.few >= 24 else 4)
def held(run: Runner, count: int) -> xr.Dataset:
    """Ruptures under an edge load that is held just above that of the first arrested event."""
    problem, field = driven("edge"), strength(setting.SECOND)

    def rest(sample):
        tau_p = field.sample(problem.interface, seed=run.seed, first=sample)[0]
        static = st.onset(problem, tau_p, method=st.Equilibrium(events=1), progress=False)
        stress = 1.005 * float(static["event_stress"][0, 0])
        if np.isnan(stress):
            return xr.Dataset({"length": np.nan})
        rise = stress / setting.LOADING_RATE
        end = rise + 10.0 * setting.CROSSING
        load = ([0.0, rise, end], [0.0, stress, stress])
        method = st.Rupture(load_history=load, stop="rest", end_time=end)
        saved = st.Save(["slip"], every=1_000_000)
        rupture = st.simulate_rupture(problem, tau_p, method=method, save=saved, progress=False)
        slip = rupture["slip"].values[-1]
        labels = patches(slip > 1e-2 * slip.max())
        longest = np.bincount(labels[labels >= 0]).max(initial=0)
        return xr.Dataset({"length": longest * problem.interface.spacing})

    return run.grid(rest, sample=range(count))


ARRESTS = ("wide_strength", "random_load", "random_residual")
"""What-ifs in which arrest is the question, also run with inertia."""
WHAT_IFS = (*ARRESTS, "normal_load", "length", "exponent", "skewness")


def what_if(run: Runner, name: str, suffix: str) -> xr.Dataset:
    """A study file of `what_if/`, its points stacked along 'point'; with a suffix by ruptures."""
    study = st.Study.from_toml(setting.WHAT_IF / f"{name}.toml")
    most = run.size.trend if study.method == LOCAL else run.size.what_if
    if suffix:
        study, most = dataclasses.replace(study, method=RUPTURE), run.size.arrests
    changed = dataclasses.replace(study, samples=min(most, study.samples), seed=run.seed)
    result = run.study(name + suffix, changed)
    swept = [dim for dim in result["critical_stress"].dims if dim != "sample"]
    numbered = result.drop_vars([name for name in result.coords if name != "sample"])
    return numbered.stack(point=swept, create_index=False).transpose("point", ...)


PAPER = ("local", moments, "exact", "ruptures", theory, representative)
"""What the paper does, in the order in which it is computed."""
MODULUS = ("printed", readings)  # asked with the paper's parameters only
BEYOND = (trend, "vanishing", window, modes, growth, mechanism, arrest, driving, "dynamic")
"""What `--full` adds."""


def jobs(full: bool):
    """Yield the name, the progress line and the function of every study."""
    for study in (*PAPER, *(() if PARAMETERS else MODULUS), *(BEYOND if full else ())):
        if isinstance(study, str):
            yield study, SWEEPS[study][0], functools.partial(sweep, name=study)
        else:
            yield study.__name__, study.__doc__.partition(".")[0], study
    # The what-ifs state parameters of their own.
    for name in WHAT_IFS if full and not PARAMETERS else ():
        for suffix in ("", "-inertia") if name in ARRESTS else ("",):
            text = f"What if: {name.replace('_', ' ')}{suffix.replace('-', ', with ')}"
            yield name + suffix, text, functools.partial(what_if, name=name, suffix=suffix)
