"""Executors that tests hand to runs to see, delay or forbid the work."""

from __future__ import annotations

import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor

import pytest


class Counting(Executor):
    """Computes at once and keeps which samples, as spans, in `spans`."""

    def __init__(self):
        self.spans = []

    def submit(self, function, experiment, span, *marks):
        self.spans.append(span)
        future = Future()
        future.set_result(function(experiment, span, *marks))
        return future


class Forbidding(Executor):
    """Fails the test if anything is to be computed."""

    def submit(self, *arguments):
        pytest.fail("work was begun")


class SlowFrom(ThreadPoolExecutor):
    """Two threads that take longer for samples from a number on."""

    def __init__(self, sample, seconds):
        super().__init__(2)
        self.sample, self.seconds = sample, seconds

    def submit(self, function, experiment, span, *marks):
        def later():
            time.sleep(self.seconds if span.first >= self.sample else 0.0)
            return function(experiment, span, *marks)

        return super().submit(later)
