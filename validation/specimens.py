"""Validation: random specimens against a path by brute force, the energy balance, and the grid.

python validation/specimens.py [paths] [grid] [--profiles 200] [--seed 0]
"""

import argparse
import math
import time
import warnings
from collections import defaultdict
from typing import Any, NamedTuple

import numpy as np
from brute_force import BruteForce, energy

import stiction as st

NODES, LENGTH = 96, 0.083  # m
INF = math.inf
MARGINAL = st.Beta(alpha=1.5, beta=3.0, low=0.68e6, high=1.61e6)


def drawn(rng: np.random.Generator) -> tuple[str, st.Problem, np.ndarray]:
    """Draw what it is, a specimen with its drive, machine, law and initial stress; a strength."""
    height = LENGTH * rng.choice([0.1, 0.15, 0.25, 0.5, 1.0])
    stiffness = rng.choice([0.0, 10.0 ** rng.uniform(6.5, 8.5), INF])
    drive: Any = st.Platen(stiffness=stiffness)
    if rng.random() < 0.6:
        width = height * rng.uniform(0.05, 0.4)
        middle = rng.uniform(0.5 * width, height - 0.5 * width)
        side: Any = rng.choice(["left", "right", "both"])
        drive = st.Pusher(height=middle, width=width, side=side, stiffness=stiffness)
    mode: Any = rng.choice(["II", "II", "III"])
    plane: Any = rng.choice(["stress", "strain"])
    options = {
        "weakening_rate": 10.0 ** rng.uniform(11.0, 11.4),
        "residual_strength": rng.choice([0.0, 0.35e6, 0.5e6, 0.62e6]),
    }
    law: Any = st.LinearWeakening(**options)
    if rng.random() < 0.4:
        corner = rng.uniform(0.2, 0.6)  # falls less steeply beyond it, or more
        law = st.PiecewiseWeakening(
            slip=(corner, 1.0),
            strength=(1.0 - corner + rng.uniform(-0.25, 0.12), 0.0),
            **options,
        )
    x = (np.arange(NODES) + 0.5) / NODES
    wave = rng.uniform(-1.0, 1.0, (3, 1)) * np.sin(rng.uniform(1.0, 9.0, (3, 1)) * x)
    try:
        problem = st.Problem(
            solid=st.Solid(
                youngs_modulus=2.7e9, poisson_ratio=rng.uniform(0.05, 0.45), density=1180.0,
                plane=plane,
            ),
            interface=st.Interface(length=LENGTH, nodes=NODES),
            friction=law,
            load=st.Load(initial_stress=2e4 * wave.sum(axis=0)),
            mode=mode,
            specimen=st.Blocks(height=height, thickness=0.0071, drive=drive),
        )  # fmt: skip
    except st.InputError:  # the pusher is so high that it shears in reverse, or too few nodes
        return drawn(rng)
    spectrum = st.PowerLawSpectrum(correlation_length=10.0 ** rng.uniform(-2.7, -2.0))
    strength = st.RandomField(MARGINAL, spectrum).sample(
        problem.interface, seed=int(rng.integers(2**31))
    )
    machine = "machine" if stiffness else "dead load"
    return (
        f"positive entries, {machine}" if problem.blocks.positive else machine,
        problem,
        strength,
    )


class Difference(NamedTuple):
    """Of a path from that by brute force: shares of the load, drops as shares of the peak."""

    load: float
    peak: float
    first: float
    events: int
    drops: float
    positive: float
    back: float
    balance: float


def compare(problem: st.Problem, strength: np.ndarray) -> tuple[Difference, int]:
    """Return the differences of one sample, and how many events it has by brute force."""
    brute = BruteForce(problem, strength).run()
    found = st.onset(problem, strength, method=st.Equilibrium(events=200)).isel(sample=0)
    drops = found.event_stress_drop.values
    drops = drops[np.isfinite(drops)]
    same = len(drops) == len(brute.drops)
    first = 0.0
    if brute.first is not None or np.isfinite(found.first_instability):
        first = abs(float(found.first_instability) / (brute.first or np.nan) - 1.0)
    balance = energy(problem, strength, brute.kinks)
    apart = np.abs(drops - brute.drops).max(initial=0.0) if same else np.nan
    difference = Difference(
        load=abs(float(found.critical_load) / float(brute.load) - 1.0),
        peak=abs(float(found.critical_stress) / float(brute.peak) - 1.0),
        first=first,
        events=abs(len(drops) - len(brute.drops)),
        drops=float(apart / brute.peak),
        positive=problem.blocks.positive,
        back=balance.back,
        balance=float(np.abs(balance.lost[~balance.jumps]).sum() / balance.work.sum()),
    )
    return difference, len(brute.drops)


def paths(profiles: int, seed: int) -> dict[str, list[tuple[Difference, int]]]:
    """Return differences of random specimens by their kind; print those that are not small."""
    rng, found = np.random.default_rng(seed), defaultdict(list)
    start = time.monotonic()
    for number in range(profiles):
        name, problem, strength = drawn(rng)
        own, events = compare(problem, strength)
        name += ", slip goes back" if own.back > 1e-9 else ""
        found[name].append((own, events))
        if not max(own.load, own.peak, own.first, own.events, own.drops) < 1e-6:
            print(f"profile {number}: {own}; {problem.specimen}", flush=True)
        if (number + 1) % 50 == 0:
            print(f"{number + 1} of {profiles}, {time.monotonic() - start:.0f} s", flush=True)
    return found


def print_paths(found: dict[str, list[tuple[Difference, int]]]) -> None:
    """Print the worst differences of each kind."""
    for name, rows in sorted(found.items()):
        worst = Difference(*np.array([row for row, _ in rows]).max(axis=0))
        same = [row.drops for row, _ in rows if not row.events]
        print(
            f"{name}: {len(rows)} profiles, {sum(events for _, events in rows)} arrested events;"
            f" worst: onset {worst.load:.1e}, peak {worst.peak:.1e}, first {worst.first:.1e}, drops"
            f" {max(same, default=np.nan):.1e} of the peak, balance {worst.balance:.1e};"
            f" {len(rows) - len(same)} with other events; positive entries up to"
            f" {worst.positive:.1e}, slip back by up to {worst.back:.1e} of the largest;"
            f" {sum(row.load > 1e-6 for row, _ in rows)} with another onset"
        )


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
    parser.add_argument("what", nargs="?", default="paths", choices=["paths", "grid"])
    parser.add_argument("--profiles", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    warnings.simplefilter("ignore", st.AccuracyWarning)
    warnings.simplefilter("ignore", st.UnitWarning)
    if options.what == "paths":
        print_paths(paths(options.profiles, options.seed))
    else:
        for (name, nodes), error in grid().items():
            print(f"{name}, {nodes} nodes in h_n: rms {error:.3%}")


if __name__ == "__main__":
    main()
