"""How much does the interaction of slip patches lower the onset, on a line and on a plane?

Computes everything of docs/line-and-plane.md and draws its figures:
    python examples/line_and_plane.py RUNS                 (again after an interruption: it goes on)
    python examples/line_and_plane.py RUNS --samples 20    (a first look, at most 20 a point)
Runs are stored in the folder RUNS, figures go to --figures (docs/images).
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import numpy as np
import xarray as xr
from line_and_plane_figures import draw
from scipy.stats import spearmanr

import stiction as st
from stiction.ensemble.cost_estimate import probe_time

RATIOS = (0.25, 0.5, 1.0, 2.0)
"""Correlation lengths xi_0 over the nucleation length h_n of a line."""
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
FRICTION = st.SlipWeakening(weakening_rate=0.5e12)
NUCLEATION_LENGTH = st.Problem(
    SOLID, st.Interface(length=0.1, nodes=512), FRICTION
).nucleation_length
RESAMPLED = 500
QUARTERS = 4
"""How often a small interface fits into the large one of the same kind."""


@dataclasses.dataclass(frozen=True)
class Case:
    """One interface of the study; those of one size and kind have the same draws."""

    name: str
    size: int  # in h_n, along each direction
    nodes: int  # in h_n
    samples: int
    seed: int
    kept: int  # samples whose slip is kept

    @property
    def plane(self) -> bool:
        return self.name.startswith("plane")

    @property
    def problem(self) -> st.Problem:
        """The only difference between a line and a plane: two numbers for one."""
        length, nodes = self.size * NUCLEATION_LENGTH, self.size * self.nodes
        interface = (
            st.Interface(length=(length, length), nodes=(nodes, nodes))
            if self.plane
            else st.Interface(length=length, nodes=nodes)
        )
        return st.Problem(SOLID, interface, FRICTION)


CASES = (
    Case("line, small", 16, 16, 10_000, 1, 1000),
    Case("line, large", 64, 16, 10_000, 2, 1000),
    Case("plane, small", 4, 16, 1000, 3, 200),
    Case("plane, large", 8, 16, 300, 4, 100),
    # Every second node is a node of the cases above: what the grid costs.
    Case("line, small, fine", 16, 32, 1000, 1, 10),
    Case("plane, small, fine", 4, 32, 100, 3, 10),
)


def strength(ratio: float) -> st.RandomField:
    """The paper's, with the mean of the interface random: no plane is long against 2 h_n."""
    return st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=ratio * NUCLEATION_LENGTH),
        mean_mode=True,
    )


def studies(case: Case, most: int) -> dict[str, st.Study]:
    """The same samples by equilibrium and by the local criterion."""
    few = min(case.samples, most)
    lengths = [ratio * NUCLEATION_LENGTH for ratio in RATIOS]
    exact = st.Study(
        problem=case.problem,
        random=strength(RATIOS[0]),
        method=st.Equilibrium(slip=True),
        ensemble=st.Ensemble(
            samples=few, seed=case.seed, keep=("slip",), keep_samples=min(few, case.kept)
        ),
        sweep=[{"random.strength.spectrum.correlation_length": lengths}],
        title=case.name,
    )
    alone = st.Ensemble(samples=few, seed=case.seed)
    local = dataclasses.replace(exact, method=st.LocalCriterion(), ensemble=alone)
    return {"exact": exact, "local": local}


def compute(folder: Path, most: int = 10**6, progress: bool = True) -> dict[str, xr.Dataset]:
    """Run what is missing; one dataset a case, with dimensions ratio and sample."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for case in CASES:
        pair = studies(case, most)
        if progress:
            cost = probe_time(pair["exact"].plans, pair["exact"].ensemble.samples, budget=1.0)
            print(
                f"{case.name}: about {cost.seconds / 60.0:.1f} min of one core, if nothing is done yet"
            )
        results = {
            which: study.run(
                out=folder / f"{case.name.replace(', ', '-')}-{which}", progress=progress
            )
            for which, study in pair.items()
        }
        data = results["exact"].assign(local=results["local"].first_instability)
        data = data.assign_coords(ratio=("correlation_length", list(RATIOS)))
        found[case.name] = data.swap_dims(correlation_length="ratio")
    return found
