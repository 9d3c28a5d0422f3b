"""What a notebook shows of objects: every field, its unit, nothing that a page would run."""

import dataclasses
import re
from html.parser import HTMLParser

import numpy as np
import pytest

import stiction as st
from stiction.statistics.estimates import Estimate


class Balanced(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.text = [], []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def shown(thing):
    """The text of its page, after a check of the tags."""
    parser = Balanced()
    parser.feed(thing._repr_html_())
    assert parser.open == []
    return " ".join(parser.text)


@pytest.fixture(scope="module")
def problem():
    return st.paper.problem(nodes=256)


def test_a_problem_shows_its_parts_with_units(problem):
    text = shown(problem)
    for expected in ("1e+09 Pa", "1170 kg/m3", "5e+11 Pa/m", "0.1 m", "nucleation_length"):
        assert expected in text
    assert f"{problem.nucleation_length:.6g} m" in text
    assert f"{problem.solid.shear_wave_speed:.6g} m/s" in text
    assert re.search(r"poisson_ratio 0\.33 nu", text)  # a pure number has no unit


def test_every_public_class_of_parameters_has_the_one_mechanism():
    from stiction._brief import brief_html

    classes = [
        value
        for value in (getattr(st, name) for name in st.__all__)
        if dataclasses.is_dataclass(value)
    ]
    assert len(classes) > 15
    assert {cls._repr_html_ for cls in classes} == {brief_html}


def test_results(problem):
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    assert "0.0015" in shown(strength)
    method = st.LocalCriterion()
    found = st.failure_probability(problem, strength, 0.7e6, method=method, max_evaluations=2000)
    text = shown(found)
    assert f"{found.probability:.6g} Of an onset" in text
    assert "700000 Pa" in text
    assert "stress_above_bound 40000 Pa" in text
    moments = st.nucleation_statistics(problem, strength)
    assert f"{moments.variance:.6g} Pa^2" in shown(moments)
    assert "array" in shown(st.density(np.random.default_rng(0).normal(size=200)))
    assert "0.5" in shown(Estimate(0.5, 0.1))
    ensemble = st.Ensemble(samples=3)
    study = st.Study(problem=problem, random=strength, method=method, ensemble=ensemble)
    assert "shear_modulus" in shown(study)


def test_a_stored_run_says_how_far_it_is(problem, tmp_path):
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    study = st.Study(
        problem=problem,
        random=strength,
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=3),
    )
    study.run(out=tmp_path / "run")
    assert re.search(r"samples 3\s", shown(st.open_run(tmp_path / "run")))


def test_text_of_the_user_is_escaped(problem):
    study = st.Study(
        problem=problem,
        random=st.paper.strength(problem, correlation_ratio=0.5),
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=3),
        title="<script>alert(1)</script>",
    )
    assert "<script" not in study._repr_html_()


def test_what_a_problem_does_not_have_is_left_out(problem):
    rate = np.linspace(4e11, 6e11, problem.interface.size)
    varied = st.Problem(problem.solid, problem.interface, st.LinearWeakening(weakening_rate=rate))
    assert "nucleation_length" not in shown(varied)
