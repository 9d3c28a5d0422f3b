"""Mistakes, budgets that do not suffice, odd cases, and the command line of failure probability."""

import dataclasses
import re
import warnings
from dataclasses import dataclass

import numpy as np
import pytest
import typer
import xarray as xr
from refusals import refuses
from typer.testing import CliRunner

import stiction as st
from stiction.cli import reliability

LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()


@pytest.fixture(scope="module")
def system():
    problem = st.paper.problem(nodes=256)
    return problem, st.paper.strength(problem, 0.5)


@dataclass(frozen=True)
class Standing:
    """The local criterion under another name."""

    type: str
    label = "stand-in"
    chunk_size = 1024
    first_stage = "local_criterion"

    def variables(self, problem):
        return LOCAL.variables(problem)

    def supports(self, problem):
        return []

    def seconds_per_sample(self, problem):
        return 1.0 if self.type == "rupture" else 1e-3

    def prepare(self, problem):
        return LOCAL.prepare(problem)


PLACES = {
    "stress ... method ... target_cv ... max_evaluations": {
        "stress": "low", "method": st.LocalCriterion, "target_cv": 0.0,
        "max_evaluations": 3,
    },
    "algorithm: must be ... 'subset' ... got 'subsets'": {"algorithm": "subsets"},
    "seed": {"seed": -1},
    "event": {"event": "collapse"},
    "target_cv": {"target_cv": "much"},
    "max_evaluations": {"max_evaluations": True},
    "workers": {"workers": 1.5},
    "stress": {"stress": np.nan},
    "stress ... [670000.0]": {"stress": [0.67e6]},
}  # fmt: skip


@pytest.mark.parametrize("words", PLACES)
def test_a_mistake_is_named(system, words):
    options = {"stress": 0.67e6, "method": LOCAL} | PLACES[words]
    refuses(words, lambda: st.failure_probability(*system, **options))


@pytest.mark.parametrize("probability", [0.0, 1.0, -0.1, np.nan, "1e-6", 1e-40])
def test_probability_must_lie_between_zero_and_one(system, probability):
    given = {"method": LOCAL}
    refuses("probability", lambda: st.design_stress(*system, probability=probability, **given))
    refuses("smallest", lambda: st.failure_curve(*system, smallest=probability, **given))


def test_a_slow_method_goes_with_plain_sampling_only(system):
    rupture = Standing("rupture")
    for algorithm in ("subset", "two_level"):
        with pytest.raises(st.InputError, match="plain"):
            st.failure_probability(*system, 0.69e6, method=rupture, algorithm=algorithm)
    for method in (rupture, st.Rupture(loading_rate=1e9)):
        with pytest.raises(st.InputError, match="monte_carlo"):
            st.design_stress(*system, probability=1e-3, method=method)
    result = st.failure_probability(*system, 0.72e6, method=rupture, target_cv=0.2)
    assert result.algorithm == "plain"
    assert "rupture" in result.reason
    # Two hundred samples first, not a thousand.
    assert result.evaluations <= 200


def test_two_levels_need_a_uniform_weakening_rate(system):
    problem, field = system
    wave = 1.0 + 0.1 * np.cos(2.0 * np.pi * np.arange(256) / 256)
    varying = st.Problem(
        problem.solid, problem.interface, st.LinearWeakening(weakening_rate=0.5e12 * wave)
    )
    with pytest.raises(st.InputError, match="weakening rate (varies|is not uniform)"):
        st.failure_probability(varying, field, 0.67e6, method=EXACT, algorithm="two_level")
    with pytest.raises(st.InputError, match="names no less expensive method"):
        st.failure_probability(problem, field, 0.67e6, method=LOCAL, algorithm="two_level")
    with pytest.warns(st.AccuracyWarning, match="max_evaluations"):
        result = st.failure_probability(
            varying, field, 0.675e6, method=EXACT, max_evaluations=1200
        )
    assert result.algorithm == "subset"
    assert 0.0 < result.probability < 0.01


def test_warnings_point_at_the_caller(system):
    """Also those of threads, which came from concurrent.futures before."""
    with pytest.warns(st.AccuracyWarning, match="spans") as caught:
        st.failure_probability(*system, 0.665e6, method=LOCAL, target_cv=0.3, workers=2)
    assert {one.filename for one in caught} == {__file__}
    with pytest.warns(st.AccuracyWarning, match="spans") as caught:
        st.infer(
            *system, [0.69e6, 0.7e6, 0.71e6], prior={"marginal.low": (5e5, 8e5)}, method=LOCAL
        )
    assert {one.filename for one in caught} == {__file__}


def test_auto_says_why(system):
    often = st.failure_probability(*system, 0.7e6, method=LOCAL)
    assert (often.algorithm, often.evaluations >= 1000) == ("plain", True)
    assert "frequent" in often.reason
    rare = st.failure_probability(*system, 0.665e6, method=LOCAL, target_cv=0.3)
    assert rare.algorithm == "subset"
    assert "rare" in rare.reason
    both = st.failure_probability(*system, 0.665e6, method=EXACT, target_cv=0.4)
    assert both.algorithm == "two_level"
    assert both.first_stage_evaluations > both.evaluations
    assert "c.o.v." in str(both)


@pytest.mark.parametrize("algorithm", ["auto", "plain", "subset", "two_level"])
@pytest.mark.parametrize("allowed", [100, 400])
def test_the_smallest_budgets_are_kept_to(system, algorithm, allowed):
    with pytest.warns(st.AccuracyWarning, match="max_evaluations"):
        result = st.failure_probability(
            *system, 0.665e6, method=EXACT, algorithm=algorithm, target_cv=0.05,
            max_evaluations=allowed,
        )  # fmt: skip
    assert 0 < result.evaluations <= allowed
    # P is about 7e-5.
    assert result.interval[0] < 7e-5 < result.interval[1]


def test_budget_too_small_for_any_failure(system):
    with pytest.warns(st.AccuracyWarning, match="come down to"):
        result = st.failure_probability(
            *system, 0.6605e6, method=LOCAL, algorithm="subset", max_evaluations=3000
        )
    assert result.interval[0] == 0.0
    assert 1e-9 < result.interval[1] < 0.1
    with pytest.warns(st.AccuracyWarning, match="do not reach"):
        answer = st.design_stress(*system, probability=1e-9, method=LOCAL, max_evaluations=3000)
    assert answer.interval[0] == 0.66e6
    with pytest.warns(st.AccuracyWarning, match="do not reach"):
        curve = st.failure_curve(*system, method=LOCAL, smallest=1e-9, max_evaluations=3000)
    assert 1e-5 < float(curve["probability"].min()) < 1e-2
    with pytest.warns(st.AccuracyWarning):
        nothing = st.failure_probability(
            *system, 0.6605e6, method=EXACT, algorithm="two_level", max_evaluations=100
        )
    # A dozen of its samples show next to nothing, and the interval says so.
    assert nothing.evaluations <= 100
    assert nothing.interval[0] < 3e-9 < nothing.interval[1]


def test_a_median_interface_that_fails_at_once(system):
    """At the origin of the draws the strength is its median, 0.97 MPa, everywhere."""
    result = st.failure_probability(*system, 0.99e6, method=LOCAL, algorithm="subset")
    assert result.probability == 1.0
    # A thousand of a thousand: by Clopper and Pearson at least 0.025^(1/1000).
    assert result.interval == (pytest.approx(0.025**0.001), 1.0)
    assert result.cv == pytest.approx(1e-3, rel=0.01)
    chosen = st.failure_probability(*system, 0.99e6, method=LOCAL)
    assert (chosen.algorithm, chosen.probability, chosen.warnings) == ("plain", 1.0, ())


def test_first_instability_is_never_later_than_letting_go(system):
    state = st.external.limit_state(*system, EXACT)
    draws = state.draws(0, 0, 300)
    first = st.external.limit_state(*system, EXACT, event="first_instability")
    assert np.all(first(draws) <= state(draws))


class Piled(Standing):
    """Weak samples let go at the bound itself, as by rounding."""

    def prepare(self, problem):
        def solver(rows):
            values = dict(LOCAL.prepare(problem)(rows))
            low = values["critical_stress"] < 0.675e6
            values["critical_stress"] = np.where(low, 0.66e6, values["critical_stress"])
            return values

        return solver


class Misled(Standing):
    """What the local criterion holds for weak is stronger by a twentieth."""

    def prepare(self, problem):
        def solver(rows):
            values = dict(LOCAL.prepare(problem)(rows))
            stress = values["critical_stress"]
            values["critical_stress"] = np.where(stress < 0.5e6, stress + 0.05e6, stress)
            return values

        return solver


@pytest.mark.parametrize("first_stage", ["local_criterion", None])
def test_onsets_that_pile_up_on_the_bound(system, first_stage, monkeypatch):
    """Over two levels, and by subset simulation."""
    monkeypatch.setattr(Piled, "first_stage", first_stage)
    options = {"method": Piled("equilibrium"), "target_cv": 0.3}
    with pytest.warns(st.AccuracyWarning, match="is the bound itself"):
        answer = st.design_stress(*system, probability=1e-5, **options)
    assert answer.algorithm == ("two_level" if first_stage else "subset")
    assert (answer.stress, answer.stress_above_bound) == (0.66e6, 0.0)
    # Too few evaluations: what was seen is the bound, below which nothing lies.
    with pytest.warns(st.AccuracyWarning):
        few = st.design_stress(*system, probability=1e-12, max_evaluations=100, **options)
    assert few.interval[0] == 0.66e6 <= few.interval[1]


@pytest.mark.parametrize("stress", [0.16, 12.8, 100e3])
def test_a_stress_in_another_unit_is_answered_without_sampling(system, stress):
    """A coefficient, MPa, or a force: 37,000 evaluations gave P = 0 without a warning."""
    field = st.RandomField(st.Lognormal(mean=1e6, cv=0.12), system[1].spectrum)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = st.failure_probability(system[0], field, stress, method=LOCAL)
    doubted = [w for w in caught if "check the units" in str(w.message)]
    assert len(doubted) == (stress < 2e4)  # a fiftieth of the mean strength
    assert (found.probability, found.evaluations, found.algorithm) == (0.0, 0, "exact")
    assert found.interval == (0.0, 1e-15)


@pytest.mark.parametrize("stress", [48e3, 1e9])
@pytest.mark.parametrize("pressed", [False, True], ids=["uniform", "random"])
def test_a_force_as_a_stress_is_answered_at_once(system, stress, pressed):
    """A shear force, and a normal force, on a joint: minutes of subset simulation before."""
    spectrum = system[1].spectrum
    coefficient = st.RandomField(
        st.Lognormal(mean=0.2, cv=0.12), spectrum, of="friction_coefficient"
    )
    pressure = st.RandomField(st.Lognormal(mean=80e6, cv=0.1), spectrum)
    random = st.RandomInterface(
        strength=coefficient,
        normal_pressure=pressure if pressed else None,
        between={"strength": st.Lognormal(mean=1.0, cv=0.08)},
    )
    problem = dataclasses.replace(system[0], load=st.Load(normal_pressure=80e6))
    with pytest.warns(st.UnitWarning, match="check the units"):
        found = st.failure_probability(problem, random, stress, method=EXACT)
    assert (found.probability, found.evaluations) == (float(stress > 1e8), 0)
    with pytest.warns(st.UnitWarning, match="check the units"):
        found = st.failure_probability(
            problem, random, friction_coefficient=stress / 80e6, method=EXACT
        )
    assert (found.probability, found.evaluations) == (float(stress > 1e8), 0)


@pytest.fixture(scope="module")
def joint():
    """Residual strength is reached within the critical patch, so that onsets come later."""
    problem = st.Problem(
        st.Solid(1e9, 0.33, 1170.0),
        st.Interface(0.0144, 96),
        st.LinearWeakening(weakening_rate=0.5e12, residual_ratio=0.5),
    )
    spectrum = st.PowerLawSpectrum(0.3 * problem.nucleation_length)
    return problem, st.RandomField(st.Lognormal(mean=1e6, cv=0.25), spectrum, True)


def test_the_local_criterion_is_checked_by_equilibrium(joint):
    """Both probabilities are given where they differ; counting tells that they do."""
    with pytest.warns(st.AccuracyWarning, match=r"fail by the local criterion and .* by equil"):
        found = st.failure_probability(
            *joint, 0.66e6, method=LOCAL, algorithm="subset", target_cv=0.2
        )
    samples = joint[1].sample(joint[0].interface, samples=2000, seed=3)
    local, exact = (
        np.mean(st.onset(joint[0], samples, method=m, progress=False).critical_stress < 0.66e6)
        for m in (LOCAL, EXACT)
    )
    assert exact < 0.7 * local
    assert 0.4 < found.probability / local < 2.5
    with pytest.warns(st.AccuracyWarning, match="by equilibrium the probability"):
        answer = st.design_stress(*joint, probability=1e-3, method=LOCAL, target_cv=0.3)
    assert any("by equilibrium" in text for text in answer.warnings)


def test_no_word_of_equilibrium_where_it_agrees(system):
    found = st.failure_probability(*system, 0.67e6, method=LOCAL, target_cv=0.3)
    assert not any("by equilibrium" in text for text in found.warnings)


@pytest.fixture(scope="module")
def short(joint):
    """Strength that varies within a tenth of h_n, where the criterion is too high."""
    problem = dataclasses.replace(joint[0], friction=st.LinearWeakening(weakening_rate=0.5e12))
    spectrum = st.PowerLawSpectrum(0.12 * problem.nucleation_length)
    return problem, st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum, True)


def test_the_check_sees_samples_that_fail_by_equilibrium_only(short):
    """Against counting."""
    problem, strength = short
    with pytest.warns(
        st.AccuracyWarning, match=r"32 fail by the local criterion and 4\d by equil"
    ):
        found = st.failure_probability(
            problem, strength, 0.818e6, method=LOCAL, algorithm="plain", progress=False
        )
    samples = strength.sample(problem.interface, samples=1500, seed=31)
    local, exact = (
        np.mean(st.onset(problem, samples, method=m, progress=False).critical_stress < 0.818e6)
        for m in (LOCAL, EXACT)
    )
    assert exact > 1.2 * local
    assert found.probability == pytest.approx(float(local), rel=0.3)


@pytest.mark.parametrize("stress", [0.7505e6, 0.7857e6])
def test_the_check_after_subset_simulation_sees_both_sides(short, stress):
    """P of 0.95e-3 and 0.95e-2: nearly all of the last level fails, and equilibrium fails more.

    By 1.45 and 1.36 times (subset simulation by both, 5 % each). A check of the last level alone
    saw no sample that fails by equilibrium only, and five of six seeds were not warned.
    """
    with pytest.warns(st.AccuracyWarning, match="by equilibrium the probability"):
        found = st.failure_probability(*short, stress, method=LOCAL, algorithm="subset")
    counts = re.search(r"(\d+) fail by the local criterion and (\d+) by", found.warnings[-1])
    local, exact = map(int, counts.groups())
    assert 16 <= local <= 48
    assert exact > local


def test_auto_leaves_a_guide_whose_samples_do_not_fail(joint):
    """Among plain samples it picks the weakest; in the tail hardly one of its samples fails."""
    found = st.failure_probability(*joint, 0.44e6, method=Misled("equilibrium"), target_cv=0.4)
    assert found.algorithm == "subset"
    assert "a poor guide" in found.reason


@pytest.fixture(scope="module")
def app():
    command = typer.Typer()
    command.command()(reliability)
    return lambda *arguments: CliRunner().invoke(command, arguments, catch_exceptions=False)


def written(path, system, **more):
    ensemble = st.Ensemble(samples=10, seed=3)
    study = st.Study(
        problem=system[0], random=system[1], method=LOCAL, ensemble=ensemble, **more
    )
    study.to_toml(path)
    return str(path)


def test_command_writes_table_data_and_figure(app, system, tmp_path):
    study, out = written(tmp_path / "study.toml", system), tmp_path / "out"
    done = app(study, "--out", str(out), "--smallest", "1e-4")
    assert done.exit_code == 0
    assert {"failure_curve.png", "failure_curve.pdf"} <= {path.name for path in out.iterdir()}
    with xr.open_dataset(out / "failure_curve.nc") as curve:
        assert curve["stress"].attrs["units"] == "Pa"
        assert curve.attrs["lower_bound"] == 0.66e6
        again = st.failure_curve(*system, method=LOCAL, smallest=1e-4, seed=3)
        np.testing.assert_array_equal(curve["probability"], again["probability"])
    assert "probability" in done.output


@pytest.mark.parametrize("seed", range(4))
def test_small_runs_whose_states_tie(seed):
    """Of twenty samples two go on, and chains repeat them."""
    problem = st.paper.problem(nodes=136)
    field = st.paper.strength(problem, 0.5)
    with pytest.warns(st.AccuracyWarning):
        found = st.failure_probability(
            problem, field, 0.66001e6, method=LOCAL, algorithm="subset",
            max_evaluations=100 + 50 * (seed % 2), seed=seed // 2,
        )  # fmt: skip
    assert found.interval[0] < 1e-12 < found.interval[1]
