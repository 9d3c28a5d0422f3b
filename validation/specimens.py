"""Validation: random specimens against a path by brute force, the energy balance, and the grid.

python validation/specimens.py [paths] [joints] [stepping] [grid] [--profiles 200] [--seed 0]
"""

import argparse
import math
import time
import warnings
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from brute_force import Along, BruteForce, along, stepped

import stiction as st
from stiction.methods.equilibrium.patches import line_patch

LENGTH = 0.083  # m
INF = math.inf
MARGINAL = st.Beta(alpha=1.5, beta=3.0, low=0.68e6, high=1.61e6)
STEP = 2e-4
"""Step of the drive in the stepping, as a share of the mean strength."""


def drawn(rng: np.random.Generator, joints: bool) -> tuple[str, st.Problem, np.ndarray]:
    """Draw what it is, a specimen with its drive, machine, law and initial stress; a strength.

    `joints` are pushed, mostly from both sides, behind a machine that gives way to slip; they have
    few nodes, low residual strengths, and some are pressed glued.
    """
    nodes, height = 96, LENGTH * rng.choice([0.1, 0.15, 0.25, 0.5, 1.0])
    stiffness = rng.choice([0.0, 10.0 ** rng.uniform(6.5, 8.5), INF])
    residual = {"residual_strength": rng.choice([0.0, 0.35e6, 0.5e6, 0.62e6])}
    if joints:
        nodes, height = int(rng.choice([24, 32, 40, 48])), LENGTH * rng.uniform(0.1, 0.5)
        stiffness = rng.choice([10.0 ** rng.uniform(6.0, 9.0), INF])
        residual = {"residual_ratio": rng.uniform(0.0, 0.5)}
    drive: Any = st.Platen(stiffness=stiffness)
    if joints or rng.random() < 0.6:
        width = height * rng.uniform(0.05, 0.4)
        middle = rng.uniform(0.5 * width, height - 0.5 * width)
        side: Any = rng.choice(["left", "right", "both", *["both"] * 3 * joints])
        drive = st.Pusher(height=middle, width=width, side=side, stiffness=stiffness)
    mode: Any = rng.choice(["II", "II", "III"])
    plane: Any = rng.choice(["stress", "strain"])
    glued = joints and mode == "II" and rng.random() < 0.5
    options = {"weakening_rate": 10.0 ** rng.uniform(11.0, 11.4) * nodes / 96} | residual
    law: Any = st.LinearWeakening(**options)
    if rng.random() < 0.4:
        corner = rng.uniform(0.2, 0.6)  # falls less steeply beyond it, or more
        law = st.PiecewiseWeakening(
            slip=(corner, 1.0),
            strength=(1.0 - corner + rng.uniform(-0.25, 0.12), 0.0),
            **options,
        )
    x = (np.arange(nodes) + 0.5) / nodes
    wave = rng.uniform(-1.0, 1.0, (3, 1)) * np.sin(rng.uniform(1.0, 9.0, (3, 1)) * x)
    pressing: Any = "glued" if glued else "frictionless"
    try:
        problem = st.Problem(
            solid=st.Solid(
                youngs_modulus=2.7e9, poisson_ratio=rng.uniform(0.05, 0.45), density=1180.0,
                plane=plane,
            ),
            interface=st.Interface(length=LENGTH, nodes=nodes),
            friction=law,
            load=st.Load(initial_stress=2e4 * wave.sum(axis=0), normal_pressure=2.1e6),
            mode=mode,
            specimen=st.Blocks(height=height, thickness=0.0071, drive=drive, pressing=pressing),
        )  # fmt: skip
    except st.InputError:  # too few nodes
        return drawn(rng, joints)
    spectrum = st.PowerLawSpectrum(correlation_length=10.0 ** rng.uniform(-2.7, -2.0))
    strength = problem.blocks.pressure * st.RandomField(MARGINAL, spectrum).sample(
        problem.interface, seed=int(rng.integers(2**31))
    )
    machine = "machine" if stiffness else "dead load"
    return (
        f"positive entries, {machine}" if problem.blocks.positive else machine,
        problem,
        strength,
    )


class Difference(NamedTuple):
    """Of a path from that by brute force: shares of the load, drops as shares of the peak.

    Places as shares of the length, and the worst of the states along the path (`Along`).
    """

    load: float
    peak: float
    first: float
    place: float
    events: int
    drops: float
    states: float
    balance: float


def compare(problem: st.Problem, strength: np.ndarray) -> tuple[Difference, BruteForce, Along]:
    """Return the differences of one sample, the brute force and the states along the path."""
    brute = BruteForce(problem, strength).run()
    found = st.onset(problem, strength, method=st.Equilibrium(events=200)).isel(sample=0)
    drops = found.event_stress_drop.values
    drops = drops[np.isfinite(drops)]
    same = len(drops) == len(brute.drops)
    first = place = 0.0
    if brute.first is not None or np.isfinite(found.first_instability):
        first = abs(float(found.first_instability) / (brute.first or np.nan) - 1.0)
        patch = line_patch(brute.direction, problem.interface)
        place = abs(float(found.critical_position) - patch.centre[0]) / LENGTH
    states = along(problem, strength, brute.kinks)
    apart = np.abs(drops - brute.drops).max(initial=0.0) if same else np.nan
    difference = Difference(
        load=abs(float(found.critical_load) / float(brute.load) - 1.0),
        peak=abs(float(found.critical_stress) / float(brute.peak) - 1.0),
        first=first,
        place=place,
        events=abs(len(drops) - len(brute.drops)),
        drops=float(apart / brute.peak),
        states=max(states.stress, states.over, states.off, states.back),
        balance=states.imbalance,
    )
    return difference, brute, states


def paths(profiles: int, seed: int, joints: bool) -> None:
    """Compare with brute force; print the worst of each kind, and all that is not small."""
    rows: dict[str, list[tuple[Difference, int]]] = defaultdict(list)
    start = time.monotonic()
    for number in range(profiles):
        name, problem, strength = drawn(np.random.default_rng([seed, number]), joints)
        own, brute, states = compare(problem, strength)
        stops = (
            ("path", brute.stops),
            ("jumps", brute.stops_in_jumps),
            ("corners", brute.stops_at_corners),
        )
        where = [what for what, count in stops if count] + ["again"] * (states.again > 0)
        name += f", stops ({', '.join(where)})" if where else ""
        rows[name].append((own, len(brute.drops)))
        if not max(own) < 1e-9:
            print(f"profile {number}, {name}: {own}; {problem.specimen}", flush=True)
        if (number + 1) % 50 == 0:
            print(f"{number + 1} of {profiles}, {time.monotonic() - start:.0f} s", flush=True)
    for name, some in sorted(rows.items()):
        worst = np.array([own for own, _ in some]).max(axis=0)
        print(
            f"{name}: {len(some)} profiles, {sum(events for _, events in some)} arrested events;"
        )
        print(
            "  worst: "
            + ", ".join(f"{k} {v:.1e}" for k, v in zip(Difference._fields, worst, strict=True))
        )


def stepping(profiles: int, seed: int) -> None:
    """Compare random joints with a stepping in small drives; print the differences."""
    table = []
    for number in range(profiles):
        _, problem, strength = drawn(np.random.default_rng([seed, number]), True)
        found = st.onset(problem, strength, method=st.Equilibrium()).isel(sample=0)
        load, peak, first = stepped(problem, strength, STEP)
        own = (
            float(found.critical_load),
            float(found.critical_stress),
            float(found.first_instability),
        )
        table.append(np.array(own) / (load, peak, first) - 1.0)
        if np.abs(table[-1][:2]).max() > 1e-3:
            print(
                f"profile {number}: load, peak, first {table[-1]}; {problem.specimen}",
                flush=True,
            )
    for share in (50, 90, 100):
        at = np.nanpercentile(np.abs(table), share, axis=0)
        print(f"{share} % of {profiles}: load {at[0]:.1e}, peak {at[1]:.1e}, first {at[2]:.1e}")


def grid(samples: int = 30, finest: int = 1024) -> dict[tuple[str, int], float]:
    """Return the rms error of the first instability by drive and nodes in the nucleation length.

    The strengths are those of the finest grid; nothing is left at residual strength.
    """
    drives = {
        "platen": st.Platen(),
        "pusher at H/2": st.Pusher(height=0.025, width=0.005),
        "pusher at H/10": st.Pusher(height=0.005, width=0.002),
    }
    strength = st.RandomField(MARGINAL, st.PowerLawSpectrum(correlation_length=3.125e-3))
    found = {}
    for name, drive in drives.items():
        onsets = {}
        for nodes in (128, 256, finest):
            problem = st.Problem(
                st.Solid(
                    youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"
                ),
                st.Interface(length=0.1, nodes=nodes),
                st.LinearWeakening(weakening_rate=0.27787e12),
                specimen=st.Blocks(height=0.05, drive=drive),
            )
            own = strength.sample(problem.interface, samples=samples, seed=4)
            onset = st.onset(problem, own, method=st.Equilibrium())
            onsets[nodes] = onset.first_instability.values
        for nodes in (128, 256):
            error = onsets[nodes] / onsets[finest] - 1.0
            found[name, nodes // 16] = float(np.sqrt(np.mean(error**2)))
    return found


def main() -> None:
    """Print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "what", nargs="?", default="paths", choices=["paths", "joints", "stepping", "grid"]
    )
    parser.add_argument("--profiles", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore", st.AccuracyWarning)
    warnings.simplefilter("ignore", st.UnitWarning)
    if options.what == "stepping":
        stepping(options.profiles, options.seed)
    elif options.what != "grid":
        paths(options.profiles, options.seed, options.what == "joints")
    else:
        for (name, nodes), error in grid().items():
            print(f"{name}, {nodes} nodes in h_n: rms {error:.3%}")


if __name__ == "__main__":
    main()
