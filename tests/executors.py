"""Executors that tests hand to runs to see, delay or forbid the work."""

from __future__ import annotations

from concurrent.futures import Executor, Future

import pytest


class Counting(Executor):
    """Computes at once and keeps which samples, as spans, in `spans`."""

    def __init__(self, **others):
        self.spans, self.others = [], others

    def submit(self, function, experiment, span):
        self.spans.append(span)
        future = Future()
        future.set_result(function(experiment, span)._replace(**self.others))
        return future


class Forbidding(Executor):
    """Fails the test if anything is to be computed."""

    def submit(self, *arguments):
        pytest.fail("work was begun")
