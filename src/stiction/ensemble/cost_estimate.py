"""How long a study will take and how much it will store, from a short timed probe."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiction.ensemble.monte_carlo import wide_bytes
from stiction.ensemble.plan import Plan
from stiction.ensemble.work import Failure, do_work
from stiction.errors import collect_warnings

PROBED = 5


@dataclass(frozen=True)
class Estimated:
    """What a study will cost.

    Attributes
    ----------
    seconds : float
        Of one core, in all.
    per_sample : (float, float)
        Least and most seconds a sample, over the points that were probed.
    probed : int
        Points that were probed; the others are interpolated.
    failures : tuple of str
        Samples of the probe that failed.
    """

    seconds: float
    per_sample: tuple[float, float]
    probed: int
    failures: tuple[str, ...]


def probe_time(
    plans: Sequence[Plan], samples: int, first: int = 0, *, budget: float = 2.0
) -> Estimated:
    """Time a few samples of a few points.

    Parameters
    ----------
    plans : sequence of Plan
    samples, first : int
        Of each point.
    budget : float
        Seconds that the probe may take, apart from preparation and compilation.
    """
    chosen = np.unique(np.linspace(0, len(plans) - 1, PROBED).round().astype(int))
    rates: list[float] = []
    failures: list[Failure] = []
    with collect_warnings():  # the run itself will say so
        for point in chosen:
            plan = plans[point]
            failures += do_work(plan, int(point), first, 1).failures  # compiles and prepares
            share, best = budget / chosen.size, np.inf
            done, count, spent = 0, 1, 0.0
            while spent < share and done < samples:
                count = min(count, samples - done)
                outcome = do_work(plan, int(point), first + done, count)
                spent += outcome.seconds
                done += count
                rate = outcome.seconds / count
                best = min(best, rate)  # few samples at once cost more each
                failures += outcome.failures
                count = max(1, min(2 * count, plan.piece, int((share - spent) / rate)))
            rates.append(float(best))
    total = float(np.interp(np.arange(len(plans)), chosen, rates).sum()) * samples
    texts = tuple(dict.fromkeys(str(failure) for failure in failures))
    return Estimated(total, (min(rates), max(rates)), len(chosen), texts)


def stored_bytes(plans: Sequence[Plan], samples: int, first: int = 0) -> float:
    """Bytes that the results take."""
    narrow = [len(plan.variables) - len(plan.wide) + 2 for plan in plans]
    wide = sum(wide_bytes(plan, samples, first) for plan in plans)
    return 8.0 * samples * sum(narrow) + wide
