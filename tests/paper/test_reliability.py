"""What the paper's field, which has no mean mode, does to the lower tail."""

import dataclasses
import math

import pytest
from importance import by_importance

import stiction as st


def longer(problem, times):
    """The same problem on a line that is so many times longer."""
    interface = st.Interface(times * problem.interface.extent, times * problem.interface.size)
    return dataclasses.replace(problem, interface=interface)


def growth(mean_mode, stress):
    """P of four times the length over P, and its coefficient of variation."""
    problem = st.paper.problem(nodes=512)
    own = st.paper.strength(problem, 0.5)
    field = st.RandomField(own.marginal, own.spectrum, mean_mode)
    short, long = (
        by_importance(one, field, stress, st.LocalCriterion(), 0.07)
        for one in (problem, longer(problem, 4))
    )
    error = math.hypot(short.cv, long.cv)
    return long.probability / short.probability, error


@pytest.mark.slow
def test_the_weakest_link_rule_holds_with_a_mean_mode_and_fails_without():
    """At P of a few 1e-9 survival to the power of the length is linear: a factor of four."""
    ratio, error = growth(True, 0.66035e6)
    # Three standard errors, 0.3 in all.
    assert abs(math.log(ratio / 4.0)) < 3.0 * error
    # A dip at fixed mean of z has to be paid for; a longer interface can better afford it.
    ratio, error = growth(False, 0.66035e6)
    assert ratio > 4.0 * math.exp(2.0 * error)
