"""Named constants of the package: what changes if each is half, or twice, as large?

    python validation/constants.py [FOLDER or FILE ...] [--problems fields ...] [--seconds 600]

For each constant, a number or several, that stands at the top of a module (below the folders, if
any are given), a fixed set of small problems is solved with half and with twice its value. One line
is printed for each: the largest change of a result, as a share of it, with the name of the result,
and the time over that without a change. Two calls without a change tell what differs by itself;
what is round-off itself is left out. A constant that changes nothing may go; one that changes a
result by more than its stated accuracy is a fault. What a compiled kernel has taken in is left out,
with its name: it changes only if the package is compiled anew.
"""

import argparse
import ast
import contextlib
import importlib
import math
import multiprocessing
import sys
import time
import warnings
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import xarray as xr

import stiction as st

PACKAGE = Path(st.__file__).parent
SIZES = 0.5, 2.0


def problem(length=0.1, nodes=128, weakening_rate=0.3e12, specimen=None, **law):
    """One interface of a polymer; the solid's plane state is that of a plane or a line."""
    plane = {} if isinstance(nodes, tuple) else {"plane": "stress"}
    return st.Problem(
        st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, **plane),
        st.Interface(length, nodes),
        st.LinearWeakening(weakening_rate=weakening_rate, **law),
        specimen=specimen,
    )


MARGINAL = st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
FIELD = st.RandomField(MARGINAL, st.PowerLawSpectrum(4e-3), mean_mode=True)
LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()


def onsets(system, method, samples=3):
    """Onsets of a few samples, all that the method returns."""
    profiles = FIELD.sample(system.interface, samples=samples, seed=3)
    return st.onset(system, profiles, method=method, progress=False)


def lines():
    """Onset and path on half-spaces, with arrests."""
    system = problem(residual_ratio=0.6)
    path = st.equilibrium_path(
        system, FIELD.sample(system.interface, seed=5)[0], np.linspace(0.3e6, 1.1e6, 9)
    )
    return {"exact": onsets(system, EXACT), "local": onsets(problem(), LOCAL), "path": path}


def planes():
    """Onset on a small plane, with and without a residual strength."""
    return {
        f"{method.type} {ratio}": onsets(
            problem((0.05, 0.04), (32, 32), 0.25e12, residual_ratio=ratio), method, 2
        )
        for method, ratio in ((EXACT, 0.0), (EXACT, 0.7), (LOCAL, 0.0))
    }


def specimens():
    """Plates behind a machine, pushed from one side."""
    drive = st.Pusher(height=0.01, width=0.005, stiffness=3e7)
    blocks = st.Blocks(height=0.05, thickness=0.006, drive=drive)
    system = problem(nodes=64, weakening_rate=0.06e12, specimen=blocks, residual_ratio=0.4)
    return {method.type: onsets(system, method) for method in (EXACT, LOCAL)}


def ruptures():
    """One rupture to sliding, and one held below it."""
    system = problem(nodes=64, weakening_rate=0.15e12, residual_ratio=0.5)
    held = st.Rupture(load=[[0.0, 1e-3, 3e-3], [0.0, 0.7e6, 0.7e6]], end_time=3e-3)
    return {
        "rising": onsets(system, st.Rupture(loading_rate=1e8), 1), "held": onsets(system, held, 1)
    }  # fmt: skip


def fields():
    """Samples, correlation, and fields conditioned on few, many and contradicting values."""
    line = problem().interface
    whole = FIELD.sample(line, samples=2, seed=1)
    found = {
        "sample": whole,
        "correlation": FIELD.correlation(line),
        "length": FIELD.efolding_length(),
    }
    for count, noise, apart in ((16, 2e4, 0.0), (16, 3e5, 0.0), (60, 1e3, 0.0), (40, 2e4, 8e4)):
        at = np.random.default_rng(count).choice(line.size, count, replace=False)
        values = whole[0, at] + apart * np.random.default_rng(1).standard_normal(count)
        given = FIELD.given(xr.DataArray(values, {"x": line.x[at]}, "x"), noise=noise)
        found[f"given {count} {noise:g}"] = {
            "sample": given.sample(line, samples=2, seed=1),
            "quantile": given.quantile(line, 0.05),
        }
    return found


def answers():
    """A failure probability, and what ten peaks tell."""
    system = problem()
    rare = st.failure_probability(system, FIELD, 0.62e6, method=LOCAL, progress=False)
    peaks = onsets(system, LOCAL, 10).critical_stress.values
    posterior = st.infer(
        system, FIELD, peaks, prior={"marginal.high": (1.2e6, 2.6e6)}, method=LOCAL,
        samples=200, progress=False,
    )  # fmt: skip
    fit = st.fit_field(
        FIELD.sample(system.interface, samples=2, seed=9), system.interface, marginal="beta",
        spectrum={"type": "power_law", "exponent": 4}, noise=0.0, bootstrap=20, progress=False,
    )  # fmt: skip
    return {
        "probability": rare.probability,
        "posterior": [*posterior.interval("marginal.high"), posterior.log_evidence],
        "fit": list(fit.parameters.values()),
    }


PROBLEMS = {one.__name__: one for one in (lines, planes, specimens, ruptures, fields, answers)}
ROUND_OFF = ("certificate_gap", "start_error", "kinetic_stress")


def numbers(found, name=""):
    """All numbers of a nested result by name, as arrays."""
    if hasattr(found, "data_vars"):
        found = {key: one.values for key, one in found.data_vars.items()}
    if isinstance(found, dict):
        pairs = (numbers(one, f"{name}.{key}".strip(".")) for key, one in found.items())
        return {key: one for each in pairs for key, one in each.items()}
    array = np.asarray(found)
    return {name: array.astype(float)} if array.dtype.kind in "fiub" else {}


def forget():
    """Empty every cache of the package."""
    for name, module in list(sys.modules.items()):
        if name.startswith("stiction"):
            for one in list(vars(module).values()):
                if callable(getattr(one, "cache_clear", None)):
                    with contextlib.suppress(Exception):
                        one.cache_clear()


def solved(chosen):
    """Numbers of all problems, or the error that ends one, and processor seconds."""
    found, begun = {}, time.process_time()
    forget()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for one in chosen:
            try:
                found |= numbers(one(), one.__name__)
            except Exception as error:
                found[f"{one.__name__}: {type(error).__name__} {error}"[:120]] = np.array(
                    np.inf
                )
    return found, time.process_time() - begun


def change(found, before):
    """Largest change of a number, as a share of the largest of its array, and where."""
    worst, where = 0.0, ""
    for name in {**before, **found}:
        if name.endswith(ROUND_OFF):
            continue
        if name not in found or name not in before or found[name].shape != before[name].shape:
            return math.inf, name
        one, other = found[name], before[name]
        scale = np.max(np.abs(other), where=np.isfinite(other), initial=0.0) or 1.0
        away = np.where(one == other, 0.0, np.abs(one - other) / scale)
        away[np.isnan(one) & np.isnan(other)] = 0.0
        most = float(np.nan_to_num(away, nan=np.inf).max(initial=0.0))
        if most > worst:
            worst, where = most, name
    return worst, where


def constants(places):
    """Names of constants with the module that defines them."""
    for path in sorted(PACKAGE.rglob("*.py")):
        if places and not any(place in str(path.relative_to(PACKAGE)) for place in places):
            continue
        parts = ("stiction", *path.relative_to(PACKAGE).with_suffix("").parts)
        module = importlib.import_module(".".join(parts).removesuffix(".__init__"))
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            targets = node.targets if isinstance(node, ast.Assign) else []
            each = [one for target in targets for one in getattr(target, "elts", [target])]
            for name in (
                one.id for one in each if isinstance(one, ast.Name) and one.id.isupper()
            ):
                value = getattr(module, name)
                entries = value if isinstance(value, tuple) else (value,)
                if all(isinstance(v, int | float) and not isinstance(v, bool) for v in entries):
                    yield module, name, value


def scaled(value, by):
    """The same number or numbers, larger; whole ones stay whole."""
    if isinstance(value, tuple):
        return tuple(scaled(one, by) for one in value)
    return max(1, round(value * by)) if isinstance(value, int) else value * by


def holders(name, value):
    """Modules that have a constant, and whether a compiled function has taken it in."""
    found, compiled = [], False
    for module in [m for n, m in list(sys.modules.items()) if n.startswith("stiction")]:
        if vars(module).get(name) is value:
            found.append(module.__name__)
            kernels = [one for one in vars(module).values() if hasattr(one, "py_func")]
            compiled |= any(name in one.py_func.__code__.co_names for one in kernels)
    return found, compiled


def varied(there, name, value, chosen):
    """Numbers with another value of a constant, and processor seconds; in a process of its own."""
    for one in there:
        setattr(sys.modules[one], name, value)
    return solved([PROBLEMS[one] for one in chosen])


def main(places, chosen, seconds):
    before, _ = solved([PROBLEMS[name] for name in chosen])
    again, base = solved([PROBLEMS[name] for name in chosen])
    print(f"{base:.1f} s; by itself: {change(again, before)}", flush=True)
    assert not any(":" in name for name in before), [name for name in before if ":" in name]
    begun, of_kernels, fork = time.monotonic(), [], multiprocessing.get_context("fork")
    for module, name, value in constants(places):
        there, compiled = holders(name, value)
        label = f"{module.__name__.removeprefix('stiction.')}.{name}"
        if compiled:
            of_kernels.append(label)
            continue
        found = []
        for by in SIZES:
            with ProcessPoolExecutor(1, mp_context=fork) as pool:
                other = pool.submit(varied, there, name, scaled(value, by), chosen)
                try:
                    values, took = other.result()
                    most, where = change(values, before)
                except BrokenProcessPool:
                    most, where, took = math.inf, "the process died", 0.0
            found.append(f"{most:8.1e} {where:40.40s} {took / base:5.2f}")
        print(f"{label:48s} {value!s:20.20s} | {' | '.join(found)}", flush=True)
        if time.monotonic() - begun > seconds:
            print("out of time")
            break
    print("in kernels:", ", ".join(of_kernels))


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("places", nargs="*")
    parser.add_argument("--problems", nargs="*", default=[*PROBLEMS], choices=PROBLEMS)
    parser.add_argument("--seconds", type=float, default=600.0)
    given = parser.parse_args()
    main(given.places, given.problems, given.seconds)
