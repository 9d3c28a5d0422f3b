"""Short forms of the campaigns: the same trials, fewer of them."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

CAMPAIGNS = Path(__file__).parents[2] / "campaigns"


@pytest.fixture(autouse=True)
def campaigns(monkeypatch):
    if sys.platform != "linux":
        pytest.skip("limits of memory and time are measured by Linux's means")
    monkeypatch.syspath_prepend(str(CAMPAIGNS))


@pytest.mark.slow
def test_bad_arguments_are_refused():
    import arguments

    summary = arguments.campaign(300, seed=5)
    assert summary.trials == 300
    assert summary.counts["refused"] > 200
    assert not summary.faults, str(summary)


def test_mutated_studies_are_refused_or_right():
    import studies

    summary = studies.campaign(150, seed=5)
    assert summary.trials == 150
    assert not summary.faults, str(summary)


def test_a_traceback_a_hang_and_hunger_are_faults():
    import harness

    def forever():
        while True:
            pass

    assert harness.trial(lambda: json.loads("{"))[0] == "FAULT traceback"
    assert harness.trial(forever, seconds=0.2)[0] == "FAULT hang"
    assert harness.trial(lambda: np.ones(10**9))[0] == "FAULT memory"
