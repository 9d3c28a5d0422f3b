"""Planes of which not all is known: what is warned of, and by how much."""

import dataclasses
import re

import numpy as np
import pytest
from crooked import PLANE, PLANE_STRENGTH
from setups import exact_onset

import stiction as st
from stiction.cli.pages import write_report
from stiction.methods.equilibrium import solver
from stiction.methods.equilibrium.state import Jump, Outcome, PathStatus
from stiction.methods.equilibrium.transforms import plane as search
from stiction.methods.equilibrium.transforms.relaxation import Relaxed

TWO = np.stack([PLANE_STRENGTH, 1.04 * np.roll(PLANE_STRENGTH, (5, 7), (0, 1))])


def test_bounds_that_do_not_close_are_warned_of_with_their_distance(monkeypatch):
    # As if Newton's method and bisection had got nowhere.
    monkeypatch.setattr(search, "close_by_newton", lambda *a, **k: (False, 0.0))
    monkeypatch.setattr(search, "_narrow", lambda *a, **k: 0.0)
    with pytest.warns(st.AccuracyWarning, match=r"2 of 2 samples \(0, 1\).*apart"):
        found = exact_onset(PLANE, TWO)
    assert (found["certificate_gap"] > 1e-3 * found["first_instability"]).all()


def test_a_path_that_is_lost_is_warned_of(monkeypatch):
    """In its first jump, before it, or after a jump that came to rest."""
    follow_on = search.PlaneSearch.next
    whole = exact_onset(PLANE, PLANE_STRENGTH).critical_load.item()

    def path_lost(*given):
        return dataclasses.replace(follow_on(*given), status=PathStatus.GIVEN_UP)

    def at_rest(own, sample, state, to_rest):
        monkeypatch.setattr(search.PlaneSearch, "next", path_lost)
        return Jump(Outcome.ARRESTED, state)

    for owner, name, lost in (
        (search, "least_equilibrium", lambda *given, **_: Relaxed(Outcome.UNDECIDED, given[3])),
        (search.PlaneSearch, "next", path_lost),
        (search.PlaneSearch, "jump", at_rest),
    ):
        monkeypatch.setattr(owner, name, lost)
        text = r"not followed .* in 1 of 1 samples \(0\): .* a lower bound"
        with pytest.warns(st.AccuracyWarning, match=text):
            ends = exact_onset(PLANE, PLANE_STRENGTH)
        monkeypatch.undo()
        assert ends["critical_load"].item() >= whole


def test_the_sample_that_fails_is_named(monkeypatch):
    real, seen = solver.follow_to_sliding, []

    def second_fails(*arguments):
        seen.append(arguments)
        if len(seen) == 2:
            raise FloatingPointError("singular")
        return real(*arguments)

    monkeypatch.setattr(solver, "follow_to_sliding", second_fails)
    with pytest.raises(FloatingPointError) as caught:
        exact_onset(PLANE, TWO[[0, 1, 0]])
    assert caught.value.__notes__ == ["in sample 1 of the 3 that were solved together"]


def test_a_study_of_given_profiles_and_its_report(tmp_path):
    """The onset is that of the profiles alone, and its table has both components of the place."""
    study = st.Study(
        problem=PLANE, profiles={"strength": PLANE_STRENGTH}, method=st.LocalCriterion()
    )
    result = study.run(out=tmp_path / "run", progress=False)
    alone = st.onset(PLANE, PLANE_STRENGTH, method=st.LocalCriterion())
    np.testing.assert_array_equal(result.critical_position, alone.critical_position)
    write_report(st.open_run(tmp_path / "run"), tmp_path / "page.html")
    x, y = 1e3 * alone.critical_position.values[0]
    text = (tmp_path / "page.html").read_text("utf-8")
    row = re.search(
        r"position x \(mm\).*position y \(mm\).*<td>(.*?)</td><td>(.*?)</td></tr>", text, re.S
    )
    assert row[1] == f"{x:.5g}"
    assert row[2] == f"{y:.5g}"
