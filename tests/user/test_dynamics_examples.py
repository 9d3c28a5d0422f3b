"""The validation scripts compute what the validation page says (small forms of some)."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

VALIDATION = Path(__file__).parents[2] / "validation"


def load(name):
    spec = importlib.util.spec_from_file_location(name, VALIDATION / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_memory_script():
    found = load("memory").compute()
    # 4.8e-8, 2.1e-6 and 1.3e-3 on the page.
    assert found["exponentials, 1e-06"].max() < 1e-6
    assert found["exponentials, 1e-04"].max() < 1e-4
    assert 1e-4 < found["history cut at 100"].max() < 1e-2


def test_energy_script():
    errors = load("energy").compute()
    order = np.log2(errors[0][1] / errors[1][1])
    assert order == pytest.approx(2.0, abs=0.3)  # 1.93 on the page


def test_onset_script():
    found = load("onset").compute(nodes=256, samples=2, rates=(1e5, 2e7))
    for difference in found.values():
        assert np.abs(difference[0]).max() < 5e-6
        assert np.abs(difference[1]).max() < 1e-3


def test_grid_script():
    found = load("grid").compute((0.25,), (512, 2048), samples=2)
    slip, stress = found[0.25, 512]
    # Largest of six fields on the page: 3.1 % and 0.06 %; a quarter of the dx^2 is left out.
    assert 1e-4 < slip.max() < 0.04
    assert stress.max() < 1e-3


@pytest.mark.slow
def test_remaining_scripts(tmp_path):
    waves = load("waves")
    errors = waves.compute()
    assert errors[0][1] / errors[1][1] == pytest.approx(4.0, abs=0.4)
    waves.draw(tmp_path, errors)
    kernels = load("kernels")
    for (_, tolerance), (pairs, error) in kernels.compute().items():
        assert error < 1.2 * tolerance
        assert pairs <= 26
    kernels.draw(tmp_path)
    speeds = load("rupture_speed")
    curves = speeds.compute((0.5, 2.0))
    speeds.draw(tmp_path, curves)
    assert np.nanmean(curves[0.5][1][-50:]) == pytest.approx(1.865, abs=0.01)
    assert np.nanmean(curves[2.0][1][-50:]) == pytest.approx(0.993, abs=0.003)
    assert len(list(tmp_path.glob("*.png"))) == 3
