"""Times of the package beside plain references, all in one process.

    python benchmarks/bench.py                list the cases
    python benchmarks/bench.py CASE [...]     run some, or `all`

Every row prints our time, the time of a reference that was written to be plain, and their ratio,
which means something on any machine. Times are processor times of one core. To compare two states
of the package, run the same case with each of them on PYTHONPATH, one after the other.
"""

import dataclasses
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.linalg import LinAlgError, cho_factor, cho_solve, circulant
from scipy.optimize import linprog
from scipy.special import ndtr

import stiction as st
from stiction.methods.equilibrium.solver import make_search, sample_of

RATIOS = (0.25, 0.5, 1.0, 2.0)
"""xi_0/h_n of Albertini et al. (2020)."""
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
CASES = {}


def case(function):
    """Register a case under the name of its function."""
    CASES[function.__name__] = function
    return function


def timed(function, repeats=7):
    """Return the median processor time of a call, s, after one call to warm up."""
    function()
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        spent.append(time.process_time() - start)
    return statistics.median(spent)


def row(label, ours, references=(), note=""):
    """Print our time and the ratios of references to it."""
    unit, factor = ("s", 1.0) if ours >= 0.1 else ("ms", 1e3) if ours >= 1e-4 else ("us", 1e6)
    text = "".join(f"; {name} {other / ours:,.1f} times as long" for name, other in references)
    print(f"  {label:32s} {ours * factor:9.3f} {unit}{text}{note and '; ' + note}", flush=True)


def line(nodes=1024, **friction):
    """Return the paper's interface in plane strain."""
    friction = friction or {"weakening_rate": 0.5e12}
    interface = st.Interface(0.1 * nodes / 1024, nodes)
    return st.Problem(SOLID, interface, st.LinearWeakening(**friction))


def plane(nodes, size=8):
    """Return a square plane of `size` h_n and the paper's strength at xi_0/h_n = 0.5."""
    h_n = line().nucleation_length
    interface = st.Interface((size * h_n, size * h_n), (nodes, nodes))
    return st.Problem(SOLID, interface, line().friction), field(0.5 * h_n)


def field(correlation_length, marginal=None):
    """Return the paper's strength, or one with another marginal."""
    marginal = marginal or st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6)
    return st.RandomField(marginal, st.PowerLawSpectrum(correlation_length=correlation_length))


def solver_time(problem, method, tau_p, repeats=5):
    """Return the time of a sample and what the solver gives, without the checks of `onset`."""
    rows = problem.sample(tau_p, accept=getattr(method, "accepts", ()))
    solver = method.prepare(problem)
    return timed(lambda: solver(rows), repeats) / len(tau_p), solver(rows)


def stiffness(problem):
    """Return K - W on a line as a dense matrix in units of W, from its symbol."""
    n = problem.interface.size
    symbol = 0.5 * problem.effective_modulus * problem.interface.wavenumbers
    return circulant(np.fft.irfft(symbol, n)) / problem.friction.weakening_rate - np.eye(n)


@case
def fields():
    """Random fields, beside the sum of cosines with scipy's quantile."""
    problem = line()
    for ratio in RATIOS:
        strength = field(ratio * problem.nucleation_length)
        ours = timed(lambda s=strength: s.sample(problem.interface, samples=512, seed=0)) / 512
        draws = st.RandomInterface(strength=strength).draws(problem.interface, 16, seed=0)
        sigma = strength.modes(problem.interface).sigma[1:]
        phase = 2 * np.pi * np.outer(np.arange(1, sigma.size + 1), np.arange(1024) / 1024)

        def plain(strength=strength, draws=draws, sigma=sigma, phase=phase):
            even, odd = draws[:, ::2] * sigma, draws[:, 1::2] * sigma
            z = even @ np.cos(phase) + odd @ np.sin(phase)
            return strength.marginal.distribution.ppf(ndtr(z))

        row(f"xi_0/h_n = {ratio}", ours, [("sum of cosines", timed(plain, 3) / 16)])


@case
def local():
    """The local criterion, beside quadrature of the moving average, and with its fields."""
    problem = line()
    t = (np.arange(64) + 0.5) * np.pi / 64  # s = cos t of the rounded eigenfunction, by Gauss
    v = (0.925 - 0.308 * np.cos(t) ** 2) * np.sin(t) ** 2
    x, shift = problem.interface.x, 0.5 * problem.nucleation_length * np.cos(t)

    def plain(tau_p):
        length = problem.interface.length
        shifted = [np.interp(x + one, x, tau_p, period=length) for one in shift]
        return (v @ np.array(shifted) / v.sum()).min()

    for ratio in RATIOS:
        strength = field(ratio * problem.nucleation_length)
        tau_p = strength.sample(problem.interface, samples=512, seed=0)
        ours, found = solver_time(problem, st.LocalCriterion(), tau_p)
        apart = abs(found["critical_load"][0] / plain(tau_p[0]) - 1.0)
        slow = timed(partial(plain, tau_p[0]), 5)
        row(f"xi_0/h_n = {ratio}", ours, [("quadrature", slow)], f"{apart:.0e} apart")

        def ensemble(strength=strength):
            options = {"samples": 4096, "workers": 1, "progress": False, "pilot": False}
            st.monte_carlo(problem, strength, method=st.LocalCriterion(), **options)

        row("  with its field, stored", timed(ensemble, 3) / 4096)


def by_highs(matrix, strength):
    """Return the onset, MPa, by the dual simplex method of HiGHS."""
    n = len(matrix)
    found = linprog(
        np.r_[np.zeros(n), -1.0],
        A_ub=np.c_[-matrix, np.ones(n)],
        b_ub=strength / 1e6,
        bounds=[(0, None)] * n + [(None, None)],
        method="highs-ds",
    )
    return found.x[-1]


def by_bisection(matrix, strength, tolerance=1e-9):
    """Return the onset, MPa: at each load the slipping set grows with a new factor every time."""
    strength = strength / 1e6
    low, high = strength.min(), strength.mean()
    while high - low > tolerance * high:
        load = 0.5 * (low + high)
        slipping, stable = strength < load, True
        while stable:
            nodes = np.flatnonzero(slipping)
            slip = np.zeros(len(matrix))
            try:
                factor = cho_factor(matrix[np.ix_(nodes, nodes)])
            except LinAlgError:
                stable = False
                break
            slip[nodes] = cho_solve(factor, load - strength[nodes])
            more = (matrix @ slip + strength - load < -1e-12) & ~slipping
            if not more.any():
                break
            slipping |= more
        low, high = (load, high) if stable else (low, load)
    return low


@case
def equilibrium():
    """Exact onsets on lines, beside HiGHS and bisection with dense solves."""
    problem = line()
    matrix = stiffness(problem)
    for ratio in RATIOS:
        tau_p = field(ratio * problem.nucleation_length).sample(
            problem.interface, samples=256, seed=0
        )
        ours, found = solver_time(problem, st.Equilibrium(), tau_p)
        gap = np.max(found["certificate_gap"] / found["critical_load"])
        exact = found["first_instability"][0] / 1e6
        plain = [
            ("HiGHS", timed(lambda p=tau_p[0]: by_highs(matrix, p), 1)),
            ("bisection", timed(lambda p=tau_p[0]: by_bisection(matrix, p), 1)),
        ]
        apart = abs(by_highs(matrix, tau_p[0]) / exact - 1.0)
        row(f"xi_0/h_n = {ratio}", ours, plain, f"gap {gap:.0e}, HiGHS {apart:.0e} apart")


@case
def specimens():
    """Response of blocks beside inverting K, and their onsets beside those of half-spaces."""
    free = line()
    drives = {
        "platen": st.Platen(),
        "pusher at H/2": st.Pusher(height=0.025, width=0.005),
        "pusher at H/10, machine": st.Pusher(height=0.005, width=0.002, stiffness=2e7),
    }
    strength = field(0.5 * free.nucleation_length)
    for name, drive in drives.items():
        blocks = st.Blocks(height=0.05, thickness=0.006, drive=drive)
        start = time.process_time()
        problem = st.Problem(SOLID, st.Interface(0.1, 1024), free.friction, specimen=blocks)
        spent, found = time.process_time() - start, problem.blocks
        invert = timed(lambda k=found.stiffness: np.linalg.inv(k + np.eye(len(k))), 3)
        row(f"{name}, response", spent, [("an inverse", invert)], "first time")
        tau_p = strength.sample(problem.interface, samples=64, seed=0)
        for method in (st.LocalCriterion(), st.Equilibrium()):
            ours, onsets = solver_time(problem, method, tau_p, 3)
            plain, _ = solver_time(free, method, tau_p, 3)
            events = onsets.get("arrested_events", np.zeros(1)).mean()
            note = f"{ours / plain:.1f} times as long as half-spaces; {events:.1f} events"
            row(f"  {method.type}", ours, (), note)


@case
def sliders():
    """Onsets of a slider on a base beside load steps with projected Newton (60 steps)."""
    sys.path.append(str(Path(__file__).parents[1] / "tests"))
    from rigs import LoadSteps

    for nodes in (140, 256):
        problem = st.Problem(
            solid=st.Solid(
                youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"
            ),
            interface=st.Interface(length=0.14, nodes=nodes),
            friction=st.LinearWeakening(weakening_rate=0.1e12, residual_ratio=0.64),
            load=st.Load(normal_pressure=1e6),
            specimen=st.Slider(
                height=0.075,
                base=st.Base(height=0.03, behind=0.06, ahead=0.1),
                drive=st.Pusher(height=0.006, width=0.004),
            ),
        )
        strength = st.RandomField(
            st.Beta(alpha=3.0, beta=3.0, low=0.58, high=0.82),
            st.PowerLawSpectrum(correlation_length=0.004),
            quantity="friction_coefficient",
        ).sample(problem.interface, samples=16, seed=0)
        start = time.process_time()
        rig = problem.rig
        row(f"{nodes} nodes, rig", time.process_time() - start, (), "first time")
        labelled = xr.DataArray(strength, dims=("sample", "x"), attrs={"units": "1"})
        labelled = labelled.assign_coords(x=problem.interface.x)
        ours, found = solver_time(problem, st.Equilibrium(), labelled, 3)
        pressed, spacing = 0.14e6 * rig.T_p, problem.interface.spacing
        friction = strength[0], 0.64 * strength[0], np.full(nodes, 0.1e12 * spacing)
        largest = 0.14 * float(found["critical_load"][0])

        def steps(rig=rig, friction=friction, pressed=pressed, largest=largest):
            nothing = np.zeros(len(rig.T) // 2 + 1)
            brute = LoadSteps(rig.K, rig.T, *friction, pressed, nothing[1:], nothing)
            for load in largest * np.linspace(0.0, 1.0, 61)[1:-1]:
                brute.raise_to(load)

        row(f"{nodes} nodes", ours, [("load steps", timed(steps, 1))])


@case
def planes():
    """The local criterion and exact onsets on planes, beside numpy and HiGHS."""
    problem, strength = plane(24, size=4)
    tau_p = strength.sample(problem.interface, samples=1, seed=0)
    ours, found = solver_time(problem, st.Equilibrium(), tau_p)
    k, share = problem.interface.wavenumbers, problem.interface.in_plane_share
    modulus = problem.effective_modulus * share + problem.solid.shear_modulus * (1.0 - share)
    column = np.fft.irfft2(0.5 * k * modulus, problem.interface.shape)
    places = np.ndindex(*problem.interface.shape)
    matrix = np.array([np.roll(column, place, (0, 1)).ravel() for place in places])
    matrix = matrix / problem.friction.weakening_rate - np.eye(problem.interface.size)
    plain = timed(lambda: by_highs(matrix, tau_p[0].ravel()), 1)
    apart = abs(by_highs(matrix, tau_p[0].ravel()) / found["first_instability"][0] * 1e6 - 1.0)
    row("24 x 24, equilibrium", ours, [("HiGHS", plain)], f"{apart:.0e} apart")
    for nodes in (128, 256, 512):
        problem, strength = plane(nodes)
        sample = partial(strength.sample, problem.interface, samples=1, seed=1)
        row(f"{nodes} x {nodes}, field", timed(sample))
        ours, _ = solver_time(problem, st.LocalCriterion(), sample())
        values = sample()[0]
        plain = 5 * timed(lambda v=values: np.fft.ifft2(np.fft.fft2(v)))
        row("  local criterion", ours, [("five plain convolutions", plain)])
        row("  equilibrium", solver_time(problem, st.Equilibrium(), sample(), 3)[0])
        search = make_search(problem)
        one = sample_of(problem.sample(sample()), search.pieces, 0)
        onset = timed(lambda p=search, s=one: p.next(s), 3)
        found = search.next(one)
        ours = timed(lambda p=search, s=one, f=found: p.jump(s, f), 3)
        row("  its jump", ours, [("its onset", onset)])
    problem, strength = plane(128)
    friction = line(weakening_rate=0.5e12, residual_strength=0.65e6).friction
    tau_p = strength.sample(problem.interface, samples=4, seed=0)
    without, _ = solver_time(problem, st.Equilibrium(), tau_p, 1)
    problem = st.Problem(SOLID, problem.interface, friction)
    ours, found = solver_time(problem, st.Equilibrium(), tau_p, 1)
    note = f"{found['arrested_events'].sum()} in 4 samples"
    row("128 x 128, with arrests", ours, [("without", without)], note)


@case
def rupture_step():
    """An explicit step, beside a direct convolution over the last 1,000 steps."""
    method = st.Rupture(loading_rate=1e9, implicit=False, start="rest")
    for nodes in (512, 1024, 2048, 4096):
        problem = line(nodes)
        tau_p = field(0.5 * problem.nucleation_length).sample(
            problem.interface, samples=1, seed=1
        )
        total, found = solver_time(problem, method, tau_p, 1)
        step = total / found["explicit_steps"][0]
        past = np.zeros((1000, nodes // 2 + 1), dtype=complex)
        weights, values = past.real.copy(), np.zeros(nodes)

        def plain(past=past, weights=weights, values=values):
            np.einsum("mk,mk->k", weights, past)
            for _ in range(2):
                np.fft.irfft(np.fft.rfft(values))

        row(f"{nodes} nodes", step, [("convolution", timed(plain))])


@case
def rupture_onset():
    """Onsets by elastodynamics at several loading rates, and from just below the onset."""
    problem = st.paper.problem(nodes=1024)
    for ratio in (0.25, 0.5, 2.0):
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        tau_p = strength.sample(problem.interface, samples=6, seed=1)
        for loading_rate in (1e5, 2e7, 1e9):
            method = st.Rupture(loading_rate=loading_rate, start="rest")
            rest, first = solver_time(problem, method, tau_p, 1)
            method = st.Rupture(loading_rate=loading_rate)
            ours, found = solver_time(problem, method, tau_p, 1)
            apart = np.abs(found["critical_stress"] / first["critical_stress"] - 1.0).max()
            label = f"xi_0/h_n = {ratio}, {loading_rate:.0e} Pa/s"
            row(label, ours, [("from rest", rest)], f"{apart:.0e} apart")


@case
def ends():
    """Interfaces that end: beside the same without ends, and catalogues beside local samples."""
    # A catalogue of 200 samples at 512 nodes is to take 6.7 s by equilibrium and 19 s by
    # rupture where a local sample at 512 nodes takes 57 us.
    whole = st.paper.problem(nodes=512)
    period = whole.interface.length
    part = dataclasses.replace(whole.interface, extent=(0.05 * period, 0.95 * period))
    part = dataclasses.replace(whole, interface=part)
    for ratio in RATIOS:
        strength = st.paper.strength(whole, correlation_ratio=ratio)
        tau_p = strength.sample(whole.interface, samples=200, seed=1)
        without = solver_time(whole, st.Equilibrium(), tau_p)[0]
        ours = solver_time(part, st.Equilibrium(), tau_p)[0]
        row(f"equilibrium, xi_0/h_n = {ratio}", ours, [("without ends", without)])
    options = {"seed": 1, "workers": 1, "progress": False}
    samples = partial(st.monte_carlo, whole, strength, samples=4096, pilot=False, **options)
    local = timed(partial(samples, method=st.LocalCriterion()), 3) / 4096
    row("local sample with its field", local)
    fault = heterogeneous_fault(st.Interface(4e3, 512, extent=(1e3, 3e3)), 0.05)
    for method, budget in (
        (st.Equilibrium(events=60), 6.7),
        (st.Rupture(loading_rate=1e5, events=20), 19.0),
    ):
        catalogue = partial(st.monte_carlo, *fault, method=method, samples=200, **options)
        ours = timed(catalogue, 1)
        row(f"catalogue, {method.label}", ours, [("budget", budget * local / 57e-6)])
    ellipse = st.Ellipse(centre=(1.5e3, 1e3), semi_axes=(1e3, 0.7e3))
    plane = st.Interface((3e3, 2e3), (128, 128), extent=ellipse)
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    problem, strength = heterogeneous_fault(plane, 0.1)
    tau_p = strength.sample(plane, samples=1, seed=3)
    tau_p[:, np.hypot(x - 1.5e3, y - 1e3) < 250.0] = 30e6  # a patch that breaks at once
    loaded = dataclasses.replace(problem, load=st.Load(initial_stress=35e6))
    at_once = st.Rupture(load_history=([0, 1], [0, 0]), stop="rest", end_time=20.0)
    ours = solver_time(loaded, at_once, tau_p, 1)[0]
    row("rupture, 128 x 128 nodes", ours, [("budget", 5.0 * local / 57e-6)])


def heterogeneous_fault(interface, critical_slip):
    """Return the problem and the strength of the tutorial on faults, on an interface."""
    solid = st.Solid(shear_modulus=24.3e9, poisson_ratio=0.25, density=2700.0, plane="strain")
    law = st.LinearWeakening(critical_slip=critical_slip, residual_strength=30e6)
    mode = "II" if interface.is_plane else "III"
    marginal = st.Beta(alpha=1.5, beta=2.0, low=30.2e6, high=42e6)
    spectrum = st.PowerLawSpectrum(correlation_length=300.0)
    strength = st.RandomField(marginal, spectrum, mean_mode=True)
    return st.Problem(solid, interface, law, st.Load(initial_stress=27e6), mode), strength


@case
def reliability():
    """Failure probabilities to a cv of 0.3, beside counting and OpenTURNS."""
    import openturns as ot

    problem = st.paper.problem(nodes=1024)
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    options = {"target_cv": 0.3, "workers": 1, "progress": False}
    probability = partial(st.failure_probability, problem, strength, **options)
    for method in (st.LocalCriterion(), st.Equilibrium()):
        tau_p = strength.sample(problem.interface, samples=256, seed=0)
        each, _ = solver_time(problem, method, tau_p)
        for stress in (661.6e3, 660.3e3):
            estimate = partial(probability, stress, method=method)
            ours, found = timed(estimate, 1), estimate()
            counting = each / (found.probability * 0.09)
            note = f"P = {found.probability:.1e}, {found.algorithm}, {found.evaluations} onsets"
            row(f"{method.type}, {stress / 1e3:g} kPa", ours, [("counting", counting)], note)
    state = st.external.limit_state(problem, strength, method=st.LocalCriterion())

    def onsets(z):
        return np.asarray(state(np.asarray(z)))[:, None]

    function = ot.PythonFunction(state.dimension, 1, func_sample=onsets)
    vector = ot.CompositeRandomVector(function, ot.RandomVector(ot.Normal(state.dimension)))
    subset = ot.SubsetSampling(ot.ThresholdEvent(vector, ot.Less(), 661.6e3))
    subset.setMaximumOuterSampling(20)
    subset.setBlockSize(100)
    spent = timed(subset.run, 1)
    result = subset.getResult()
    cv = result.getCoefficientOfVariation()
    note = f"P = {result.getProbabilityEstimate():.1e} ({cv:.2f})"
    row("OpenTURNS, local, 661.6 kPa", spent, (), note)


@case
def first_use():
    """The first call on an empty cache of compiled kernels, beside the second and plain numba."""
    plain = "import numba, numpy; numba.njit(lambda x: x.sum())(numpy.ones(3))"
    begin = "import stiction as st; p = st.paper.problem(nodes=256);"
    field = "t = st.paper.strength(p).sample(p.interface);"
    calls = {
        "numba and a sum": plain,
        "Problem": begin,
        "local criterion": begin + field + "st.onset(p, t, method=st.LocalCriterion())",
        "lines of the README": begin + "st.monte_carlo(p, st.paper.strength(p,"
        " correlation_ratio=0.5), method=st.LocalCriterion(), samples=10_000, progress=False)",
        "equilibrium": begin + field + "st.onset(p, t, method=st.Equilibrium())",
        "rupture": begin + field + "st.onset(p, t, method=st.Rupture(loading_rate=2e7))",
    }
    sum_alone = None
    for name, code in calls.items():
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, "STICTION_CACHE_DIR": folder, "OMP_NUM_THREADS": "1"}
            environment.pop("NUMBA_CACHE_DIR", None)
            spent = []
            for _ in range(2):
                before = os.times()
                subprocess.run([sys.executable, "-c", code], env=environment, check=True)
                after = os.times()
                spent.append(
                    after.children_user + after.children_system
                    - before.children_user - before.children_system
                )  # fmt: skip
        sum_alone = sum_alone or spent[0]
        row(name, spent[0], [("second use", spent[1]), ("numba and a sum", sum_alone)])


def main(names):
    """Run the named cases."""
    warnings.simplefilter("ignore")
    if {"-h", "--help"} & {*names}:
        print(__doc__)
        names = []
    unknown = [name for name in names if name not in CASES and name != "all"]
    if not names or unknown:
        for name, function in CASES.items():
            print(f"{name:18s} {function.__doc__}")
        sys.exit(f"unknown: {', '.join(unknown)}" if unknown else 0)
    for name in CASES if "all" in names else names:
        print(f"{name}: {CASES[name].__doc__}")
        CASES[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
