"""A law may take its scale from profiles, and no dimension of a sweep is a keyword of `sel`."""

from __future__ import annotations

import numpy as np
from setups import EXACT, LOCAL, beta_strength, ensemble, make_problem

import stiction as st
from stiction.study.sweep import SELECTION_KEYWORDS, grid_axes

FIELD = beta_strength(4e-3)
STRENGTH = FIELD.sample(st.Interface(0.05, 128), seed=2)


def test_a_law_without_a_scale_takes_it_from_profiles_only():
    problem = make_problem(128, 0.05, weakening_rate=None)
    given = {"strength": STRENGTH[0], "weakening_rate": 0.5e12}
    whole = make_problem(128, 0.05)
    for method in (LOCAL, EXACT):
        lent, own = (
            st.onset(*pair, method=method) for pair in ((problem, given), (whole, STRENGTH))
        )
        assert lent.critical_stress.item() == own.critical_stress.item()


def test_no_dimension_of_a_sweep_is_a_keyword_of_sel():
    problem = make_problem(128, 0.05)
    study = st.Study(
        problem=problem, random=FIELD, method=LOCAL, samples=4,
        sweep=[{"method": [LOCAL, EXACT]}],
    )  # fmt: skip
    stress = study.run(progress=False).critical_stress
    exact = stress.sel(onset_method="equilibrium")
    assert exact.sizes == {"sample": 4}
    alone = ensemble(problem, FIELD, 4, method=EXACT)
    np.testing.assert_array_equal(exact, alone.critical_stress)
    for keyword in SELECTION_KEYWORDS:
        (dimension,) = grid_axes([{f"method.{keyword}": [1.0, 2.0]}], (), ())
        assert dimension == f"method_{keyword}"
