"""The example of a path, small."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "equilibrium_path.py"


def test_path_example(tmp_path):
    spec = importlib.util.spec_from_file_location("equilibrium_path_example", EXAMPLE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    tau_p, onset, path = module.compute(nodes=256)
    # The last state is 1e-9 below the onset: its stress is the critical stress, its patches too.
    assert path.mean_stress.values[-1] == pytest.approx(onset.critical_stress.item(), rel=2e-9)
    slipping = path.slip.values[-1] > 0.0
    starts = np.count_nonzero(slipping & ~np.roll(slipping, 1))
    assert starts == onset.slip_patches.item()
    module.draw(tmp_path, tau_p, onset, path)
    assert (tmp_path / "equilibrium_path.png").stat().st_size > 10_000
