"""The study of lines and planes in small: it computes, tabulates, draws, and goes on."""

import dataclasses
import importlib
import itertools
import sys
from pathlib import Path

import numpy as np
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")


@pytest.fixture(scope="module")
def study():
    sys.path.insert(0, str(EXAMPLES))
    try:
        yield importlib.import_module("line_and_plane")
    finally:
        sys.path.remove(str(EXAMPLES))


def test_in_small(study, tmp_path, monkeypatch, capsys):
    """Eight nodes in h_n, six samples, and one correlation length."""
    coarse = [
        dataclasses.replace(case, nodes=16 if "fine" in case.name else 8)
        for case in study.CASES
    ]
    monkeypatch.setattr(study, "CASES", tuple(coarse))
    monkeypatch.setattr(study, "RATIOS", (0.5,))
    monkeypatch.setattr(study, "NEIGHBOURS", 2)
    arguments = [str(tmp_path / "runs"), "--samples", "6", "--figures", str(tmp_path)]
    drawing = importlib.import_module("line_and_plane_figures")
    drawn = []  # laying out and writing the figures takes longer than all the rest
    monkeypatch.setattr(study, "draw", lambda folder, *shown: drawn.append(shown))
    study.main(arguments)
    assert (
        "| xi_0/h_n | line, 16 h_n | line, 64 h_n | plane, 4 h_n | plane, 8 h_n |"
        in capsys.readouterr().out
    )
    assert [len(figure.axes) for figure in drawing.figures(*drawn[0]).values()] == [3, 4, 4]
    found = study.compute(tmp_path / "runs", 6, progress=False)  # what is stored
    plane = found["plane, small"]
    # The local criterion is an upper bound of the discrete problem, up to the gap of 1e-6.
    assert np.all(study.lowering(plane) > -1e-4)
    assert plane.sizes["sample"] == 6
    # Finer nodes carry the same samples: 8 in h_n cost a per cent at most.
    fine = found["plane, small, fine"]
    np.testing.assert_allclose(fine.first_instability, plane.first_instability, rtol=0.01)
    # Slip that is held back near the critical patch can only raise the onset.
    (far,) = study.split(study.CASES[2], plane)["far"]
    assert far.value > 0.0
    line, wide = (study.lowering(found[f"{kind}, small"]).mean() for kind in ("line", "plane"))
    assert wide > line


def test_weakest_link_is_the_mean_over_all_choices(study):
    values = np.random.default_rng(0).normal(size=9)
    least = [min(chosen) for chosen in itertools.combinations(values, 4)]
    # Sums of some hundred terms of order one, in another order.
    assert study.weakest_link(values, 4) == pytest.approx(np.mean(least), rel=1e-12)
    assert study.weakest_link(values, 1) == pytest.approx(values.mean(), rel=1e-12)
