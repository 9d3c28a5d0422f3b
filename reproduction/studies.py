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
RUPTURE = st.Rupture(loading_rate=setting.LOADING_RATE, start="rest")
CELLS = 2048
NORMAL = np.linspace(-2.0, 2.0, 17)
"""Places in standard deviations at which tau_n is compared with a normal distribution."""
TREND = (0.0625, 0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 30.0)
WINDOWS = (2.0, 4.0, 8.0, 16.0)
LOAD_SHARES = (0.88, 0.90, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99, 0.995, 0.999)
READINGS = ["a"] if PARAMETERS else list(TEXTS["reading"])  # letters of those of the modulus
SWEEPS = {
    "local": ("Onsets by the local criterion", PROBLEM, LOCAL, "samples", RATIOS),
    "exact": ("Onsets by exact equilibrium, with interaction", PROBLEM, EXACT, "samples", RATIOS),
    "ruptures": ("Ruptures until all slides", PROBLEM, RUPTURE, "ruptures", SIMULATED),
    "printed": ("Onsets by the printed modulus", STRAIN, LOCAL, "readings", SIMULATED),
    "dynamic": ("Monte Carlo study by ruptures", PROBLEM, RUPTURE, "dynamic", RATIOS),
    "vanishing": ("Onsets at vanishing correlation length, by the local criterion",
                  setting.grid(PROBLEM, span=175.0), LOCAL, "vanishing", (1 / 64,)),
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
        d = (tau_n - MEAN) / setting.DROP
        powers = [d.mean(axis=1), (d * d).mean(axis=1), (d * d * d).mean(axis=1)]
        # Least tau_n away from its minimum by more than h_n.
        where = tau_n.argmin(axis=1) * interface.spacing
        near = setting.distance(interface.x[None, :], where[:, None]) < H
        least = tau_n.min(axis=1)
        second = np.where(near, np.inf, tau_n).min(axis=1)
        variables = {
            "weakest_strength": tau_p.min(axis=1),
            "weakest_position": tau_p.argmin(axis=1) * interface.spacing,
            "largest_tau_n": tau_n.max(axis=1),
            "least_tau_n": least,
            "tie": (second - least) / (least - setting.RESIDUAL),
        }
        extremes = xr.Dataset({name: ("draw", row) for name, row in variables.items()})
        counts = np.histogram(tau_n[:, ::16], edges)[0]
        spread = setting.DEVIATION * variances[ratio] ** 0.5
        limits = [MEAN + level * spread for level in NORMAL]
        return extremes.assign(
            below=(("draw", "level"), np.array([(tau_n < s).mean(axis=1) for s in limits]).T),
            powers=(("draw", "order"), np.array(powers).T),
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
    """Theory and exact equilibrium, in each reading of the modulus."""
    count, interface = run.size.readings, PROBLEM.interface

    def in_printed(ratio: float):
        return strength(ratio, nucleation_length=setting.PRINTED_H)

    def first(dataset: xr.Dataset) -> xr.Dataset:
        return dataset.sel(correlation_ratio=list(SIMULATED)).isel(sample=slice(count))

    consistent = first(sweep(run, "exact")), first(sweep(run, "local"))
    # Of each reading: the simulation, its prediction, the prediction with its own modulus, the
    # strength, and the problem of the prediction.
    cases = {"a": (*consistent, consistent[1], strength, PROBLEM)}
    if not PARAMETERS:
        strain, strain_local, mixed, mixed_local = (
            run.sweep(name, problem, in_printed, method, count, SIMULATED)
            for name, problem, method in (
                ("strain-exact", STRAIN, EXACT), ("strain-local", STRAIN, LOCAL),
                ("mixed-exact", PROBLEM, EXACT), ("mixed-local", PROBLEM, LOCAL),
            )
        )  # fmt: skip
        printed = first(sweep(run, "printed"))
        cases["b"] = (strain, strain_local, strain_local, in_printed, STRAIN)
        cases["c"] = (mixed, strain_local, mixed_local, in_printed, STRAIN)
        cases["c'"] = (consistent[0], printed, consistent[1], strength, STRAIN)
    parts = []
    for simulated, predicted, by_one_modulus, field_of, problem in cases.values():
        stress, place = simulated["first_instability"], simulated["critical_position"]
        length, drop = problem.nucleation_length, stress - setting.RESIDUAL
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
            "excess": (predicted["first_instability"] - stress) / drop,
            "consistent_excess": (by_one_modulus["first_instability"] - stress) / drop,
            "misplaced": (("correlation_ratio", "sample"), gap > 0.5 * length),
            "patches": simulated["slip_patches"],
            "contest": (least - predicted["first_instability"]) / drop,
            "helped": (least - stress) / drop,
            "length": length / setting.L,
        }
        parts.append(xr.Dataset(variables).drop_vars("sample", errors="ignore"))
    return along("reading", READINGS, parts)


@kept()
def representative(run: Runner) -> xr.Dataset:
    """One rupture in space and time at the shortest correlation length."""
    interface = PROBLEM.interface
    tau_p = strength(FIRST).sample(interface, seed=run.seed_of(FIRST))[0]
    save = st.Save(["slip_rate", "slip"], every=6)
    result = st.simulate_rupture(PROBLEM, tau_p, method=RUPTURE, save=save, progress=False)
    critical = float(result["critical_position"])
    variables = {
        "slip_rate": (("time", "x"), result["slip_rate"].values.astype(np.float32)),
        "mean_stress": ("time", result["mean_stress"].values),
        "critical_position": critical,
        "arrested_events": int(result["arrested_events"]),
        "strength": ("x", tau_p),
        "tau_n": ("x", np.ravel(st.theory.nucleation_stress(PROBLEM, tau_p))),
    }
    critical_slip = (tau_p - setting.residual(tau_p)) / setting.W
    peak, node = int(result["mean_stress"].argmax()), round(critical / interface.spacing)
    for slip in result["slip"].values[peak:]:  # from the largest mean stress on
        labels, broken = patches(slip > 0.0), slip >= critical_slip
        patch = (labels == labels[node % interface.size]) & (labels >= 0)
        length = patch.sum() * interface.spacing
        variables.setdefault("patch_length", length)
        if broken.any():  # when the first point reaches its residual strength
            variables.setdefault("weakening_length", length)
        if length > 0.5 * setting.L:
            variables.setdefault("broken_share", broken[patch].mean())
    coordinates = {"time": result["time"].values, "x": interface.x}
    return xr.Dataset(variables, coordinates)


def trend(run: Runner) -> xr.Dataset:
    """Onsets over a wide range of correlation lengths, with L held fixed."""
    study = st.Study(
        problem=PROBLEM,
        random=strength(1.0),
        method=LOCAL,
        samples=run.size.vanishing,
        seed=run.seed,
        sweep=[{"random.strength.spectrum.correlation_length": [r * H for r in TREND]}],
    )
    result = run.study("trend", study).rename(correlation_length="ratio")
    return result[["critical_stress"]].assign_coords(ratio=list(TREND))


@kept(samples=lambda size: size.vanishing // 5)
def window(run: Runner, samples: int) -> xr.Dataset:
    """Onsets as the nucleation length vanishes, with L/xi_0 held fixed."""
    fine = setting.grid(PROBLEM, span=16.5 * WINDOWS[-1] / setting.LAST)
    field = strength(setting.LAST)

    def batch(ratio, first, count):
        weakening_rate = setting.W * ratio / setting.LAST
        friction = dataclasses.replace(fine.friction, weakening_rate=weakening_rate)
        problem = dataclasses.replace(fine, friction=friction)
        tau_p = field.sample(fine.interface, samples=count, seed=run.seed, first=first)
        least = st.theory.nucleation_stress(problem, tau_p).min(axis=1)
        weakest = tau_p.min(axis=1)
        return xr.Dataset({"stress": ("draw", least), "weakest": ("draw", weakest)})

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
        loads = setting.RESIDUAL + (load - setting.RESIDUAL) * np.array(LOAD_SHARES)
        path = st.equilibrium_path(PROBLEM, tau_p, loads)
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
    """Return the mean strength with smooth dips at places (in h_n) to 0.7 of the way from tau_r."""
    x = (PROBLEM.interface.x - 0.5 * setting.L) / H
    shape = sum(0.3 * np.exp(-2.0 * ((x - place) / 0.8) ** 2) for place in places)
    return MEAN - setting.DROP * shape


@kept()
def mechanism(run: Runner) -> xr.Dataset:
    """Patches that act on each other: one, and two at a distance."""

    def onset(profile, problem=PROBLEM) -> float:
        result = st.onset(problem, profile, method=EXACT, progress=False)
        return float(result["first_instability"][0])

    def excess(profile) -> float:
        return float(st.theory.nucleation_stress(PROBLEM, profile).min()) - onset(profile)

    x, dip = PROBLEM.interface.x - 0.5 * setting.L, dips(0.0)
    drop = onset(dip) - setting.RESIDUAL
    load = setting.RESIDUAL + 0.999 * drop
    path = st.equilibrium_path(PROBLEM, dip, [load]).isel(load=0)
    stress, slipping = path["stress"].values, path["slip"].values > 0.0
    edge, change = np.abs(x[slipping]).max(), (stress - load) / drop
    apart = [1.25, 1.5, 2.0, 3.0, 5.0, 8.0]
    # What a single dip misses is no interaction.
    lowering = [(excess(dips(-0.5 * way, 0.5 * way)) - excess(dip)) / drop for way in apart]
    # Load and strength exchanged: tau_p(x), and max tau_p with an initial stress in its place.
    gaps = []
    for tau_p in strength(setting.SECOND).sample(PROBLEM.interface, samples=16, seed=run.seed):
        missing = tau_p.max() - tau_p
        loaded = dataclasses.replace(PROBLEM, load=st.Load(initial_stress=missing))
        level, usual = onset(tau_p + missing, loaded) - missing.mean(), onset(tau_p)
        gaps.append(abs(level - usual) / (usual - setting.RESIDUAL))
    variables = {
        "one_strength": ("x", dip), "one_stress": ("x", stress), "one_load": load,
        "inside": change[slipping].mean(), "beside": np.interp(edge + 0.25 * H, x, change),
        "lowering": ("distance", lowering), "exchange": max(gaps),
    }  # fmt: skip
    return xr.Dataset(variables, {"x": PROBLEM.interface.x, "distance": apart})


@kept(samples=lambda size: size.samples, most=lambda size: 7)
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
        return xr.Dataset({"ratio": ratio, "length": length, "dynamic": count})

    parts = run.map(again, chosen)
    names = ("ratio", "length", "dynamic")
    return xr.Dataset({k: ("event", [float(part[k]) for part in parts]) for k in names})


def loads() -> dict[str, np.ndarray]:
    """Return the profiles of the study of non-uniform driving. tau_0 is the mean of each."""
    away = setting.distance(driven().interface.x, 0.5 * setting.L) / setting.L
    profiles = {
        "uniform": 1.0 + 0.0 * away,
        "gradient": 1.0 + 0.9 * (1.0 - 4.0 * away),
        "edge": 1.0 + 4.0 * np.exp(-away / 0.1),
    }
    return {name: profile / profile.mean() for name, profile in profiles.items()}


def driven(profile=1.0):
    """Return the problem under a load. Where tau_r is zero, it is set to 0.6 of the least tau_p."""
    problem = setting.grid(PROBLEM, span=16.0)
    friction = problem.friction
    if setting.RESIDUAL == 0.0:
        friction = dataclasses.replace(friction, residual_strength=0.6 * setting.LOW)
    return dataclasses.replace(problem, friction=friction, load=st.Load(profile=profile))


def driving(run: Runner) -> xr.Dataset:
    """Arrested fronts under non-uniform loads, by equilibrium and with inertia."""
    count, parts = run.size.driven, []
    for case, profile in loads().items():
        problem = driven(profile)
        residual = setting.RESIDUAL or problem.friction.residual_strength
        energy = setting.DEVIATION**2 + (MEAN - residual) ** 2
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
    return along("case", list(loads()), parts).assign(dynamic_length=held(run)["length"])


@kept(count=lambda size: size.driven)
def held(run: Runner, count: int) -> xr.Dataset:
    """Ruptures under an edge load that is held just above that of the first arrested event."""
    problem, field = driven(loads()["edge"]), strength(setting.SECOND)

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
        unstable = np.isfinite(float(rupture["first_instability"]))
        return xr.Dataset(
            {"length": longest * problem.interface.spacing if unstable else np.nan}
        )

    return run.grid(rest, sample=range(count))


@kept(samples=lambda size: 10 * size.driven, most=lambda size: size.driven)
def stress_drop(run: Runner, samples: int, most: int) -> xr.Dataset:
    """Arrest if the residual strength is random, too, and with it the stress drop."""
    field, low = strength(setting.SECOND), setting.RESIDUAL
    marginal = st.Beta(alpha=2.0, beta=2.0, low=low, high=low + 0.9 * (setting.LOW - low))
    tau_p = field.sample(PROBLEM.interface, samples=samples, seed=run.seed)
    random = strength(4.0, marginal=marginal, mean_mode=True)
    tau_r = random.sample(PROBLEM.interface, samples=samples, seed=run.seed + 1)
    friction = st.LinearWeakening(weakening_rate=setting.W)
    problem = dataclasses.replace(PROBLEM, friction=friction)
    profiles = {"strength": tau_p, "residual_strength": np.minimum(tau_r, 0.95 * tau_p)}

    def events(rows, method):
        chosen = {name: profile[rows] for name, profile in profiles.items()}
        onset = st.onset(problem, chosen, method=method, progress=False)
        return xr.Dataset({"arrested_events": ("sample", onset["arrested_events"].values)})

    (static,) = run.map(events, [(slice(None), EXACT)])
    arrested = np.flatnonzero(static["arrested_events"].values > 0)[:most]
    moving = [events([number], RUPTURE)["arrested_events"].item() for number in arrested]
    return static.assign(with_inertia=("rupture", moving))


ARRESTS = ("wide_strength", "random_load", "random_residual")
"""What-ifs in which arrest is the question, also run with inertia."""
WHAT_IFS = (*ARRESTS, "normal_load", "length", "exponent", "skewness")


def what_if(run: Runner, name: str, suffix: str) -> xr.Dataset:
    """A study file of `what_if/`, its points stacked along 'point'; with a suffix by ruptures."""
    study = st.Study.from_toml(setting.WHAT_IF / f"{name}.toml")
    most = run.size.vanishing if study.method == LOCAL else run.size.what_if
    if suffix:
        study, most = dataclasses.replace(study, method=RUPTURE), run.size.arrests
    changed = dataclasses.replace(study, samples=min(most, study.samples), seed=run.seed)
    result = run.study(name + suffix, changed)
    swept = [dim for dim in result["critical_stress"].dims if dim != "sample"]
    numbered = result.drop_vars([name for name in result.coords if name != "sample"])
    return numbered.stack(point=swept, create_index=False).transpose("point", ...)


USUAL = ("local", moments, "exact", "ruptures", theory, representative, readings, "vanishing",
         window, modes, growth, mechanism, arrest, driving, stress_drop)  # fmt: skip
"""What the statements of abstract and conclusions need, in the order of computation."""
LONG = (trend, "dynamic")  # what `--full` adds


def jobs(full: bool):
    """Yield the name, the progress line and the function of every study."""
    for study in (*USUAL, *(() if PARAMETERS else ("printed",)), *(LONG if full else ())):
        if isinstance(study, str):
            yield study, SWEEPS[study][0], functools.partial(sweep, name=study)
        else:
            yield study.__name__, study.__doc__.partition(".")[0], study
    # The what-ifs state parameters of their own.
    for name in WHAT_IFS if full and not PARAMETERS else ():
        for suffix in ("", "-inertia") if name in ARRESTS else ("",):
            text = f"What if: {name.replace('_', ' ')}{suffix.replace('-', ', with ')}"
            yield name + suffix, text, functools.partial(what_if, name=name, suffix=suffix)
