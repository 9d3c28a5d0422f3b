"""Warnings: one for one doubt, however the samples were computed."""

import warnings
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest
from setups import beta_strength
from specimens import crooked

import stiction as st
from stiction.base.errors import merge_warnings, warn_user


def joint(samples, **options):
    """Samples of a lap joint behind a stiff machine, in many of which a node that slipped stops."""
    drive = st.Pusher(height=0.01, width=0.004, side="both", stiffness=float("inf"))
    problem = crooked(
        nodes=48, height=0.05, drive=drive, weakening_rate=0.06e12, residual=0.2e6
    )
    given = {"method": st.Equilibrium(), "samples": samples, "progress": False} | options
    with pytest.warns(st.AccuracyWarning) as caught:
        found = st.monte_carlo(problem, beta_strength(1.75e-3), **given)
    told = [str(one.message) for one in caught if "stops before" in str(one.message)]
    stopped = np.isnan(found.certificate_gap).sum().item()  # then no bound is known
    assert all(f" in {stopped} of" in text for text in told)
    return told


def test_one_warning_for_all_batches_threads_and_processes(monkeypatch):
    (whole,) = joint(16)
    monkeypatch.setattr("stiction.ensemble.experiment.Experiment.batch", 7)
    monkeypatch.setattr(
        "stiction.ensemble.batches.PIECE_SECONDS", 1e-3
    )  # pieces as small as can be
    assert " of 16 samples (" in whole
    assert joint(16) == [whole] == joint(16, workers=2)
    with ProcessPoolExecutor(1) as pool:
        assert joint(16, executor=pool) == [whole]


def merging(*work):
    """Texts of the warnings that are issued after all work."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        with merge_warnings() as found:
            for one in work:
                one(found)
    return [str(one.message) for one in caught]


def test_texts_that_differ_in_numbers_are_one_with_their_range():
    def work(_):
        for size, count in ((2.5, 3), (1e-3, 1_200), (-4.0, 3)):
            warn_user(f"law1: off by {size:g} m at {count:,} nodes", st.UnitWarning)
            warn_user(f"law1: off by {size:g} m at {count:,} nodes", st.AccuracyWarning)
        warn_user("law2: off by 3 m at 1 nodes", st.UnitWarning)
        with merge_warnings():  # a range within a range
            warn_user("law2: off by 5 m at 1 nodes", st.UnitWarning)
            warn_user("law2: off by 7 m at 1 nodes", st.UnitWarning)

    one = "law1: off by -4 to 2.5 m at 3 to 1,200 nodes"
    assert merging(work) == [one, one, "law2: off by 3 to 7 m at 1 nodes"]
