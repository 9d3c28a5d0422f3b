"""Inputs that change by 1e-12 move no recorded result by more than its tolerance.

The calls of tests/records, with profiles that are changed where they enter: as a user's, or as the
package's own. Every solid is changed, too. Blocks with pushers that end where the block ends are
changed themselves.
"""

from importlib import import_module

import numpy as np
import pytest
from checks import assert_close
from recording import differences, outputs_of, read, record_of
from specimens import crooked

import stiction as st
from stiction.ensemble import experiment
from stiction.problem.problem import Problem
from stiction.problem.solid import Solid

NAMES = "lines", "planes", "specimens", "ruptures", "fields", "reliability", "inference"
FILES = [import_module(f"records.test_{name}") for name in NAMES]
REFITTED = "fit", "forces_whose_area"
"""Calls that take long, and do so because they fit or simulate again and again."""
CALLS = [
    (file, name)
    for file in FILES
    for name in file.calls
    if not any(x in name for x in REFITTED)
]


MOVED = "strength", "initial_stress", "load_profile", "normal_pressure"
"""Profiles of a sample. Some residual strengths equal the strength, and must stay equal."""


def moved(values, seed=8):
    """Values that change by up to 1e-12 of themselves."""
    change = np.random.default_rng(seed).uniform(-1e-12, 1e-12, np.shape(values))
    return values * (1.0 + change)


@pytest.mark.parametrize(("file", "name"), CALLS, ids=[name for _, name in CALLS])
def test_round_off_of_profiles_and_solids_moves_no_result(file, name, monkeypatch):
    placed, own = Problem.sample, experiment.own_sample
    modulus = Solid.effective_modulus

    def changed(rows):
        profiles = {name: moved(getattr(rows, name), seed) for seed, name in enumerate(MOVED)}
        rate = rows.weakening_rate * moved(1.0)  # a uniform rate stays uniform
        return rows._replace(weakening_rate=rate, **profiles)

    monkeypatch.setattr(
        Problem, "sample", lambda *given, **more: changed(placed(*given, **more))
    )
    monkeypatch.setattr(experiment, "own_sample", lambda *given: changed(own(*given)))
    monkeypatch.setattr(Solid, "effective_modulus", lambda *given: moved(modulus(*given)))
    call, recorded = file.calls[name], read(record_of(file.__file__))[name]
    assert differences(outputs_of(call), recorded, call.close) == []


@pytest.mark.parametrize(
    ("centre", "width", "more"),
    [(0.9, 0.2, {}), (0.04, 0.08, {"stiffness": 2e7}), (0.5, 1.0, {"side": "both"})],
    ids=["at the top", "at the interface", "all of both sides"],
)
def test_round_off_of_heights_moves_no_block(centre, width, more):
    """Of blocks and of pushers that end together."""
    blocks = []
    for exact in (True, False):
        height, at, wide = 0.025 * np.array([1.0, centre, width])
        height, at, wide = (height, at, wide) if exact else moved(np.array([height, at, wide]))
        drive = st.Pusher(height=float(at), width=float(wide), **more)
        found = crooked(height=float(height), drive=drive).blocks
        names = "stiffness", "shear", "pressure", "drive_stiffness"
        blocks.append({name: getattr(found, name) for name in names})
    assert_close(*blocks, 1e-7)
