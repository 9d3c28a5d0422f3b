"""Failure probability: the lower tail of tau_cr far beyond what counting reaches."""

from __future__ import annotations

import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.papers.albertini2020.studies.context import Context
from stiction.reliability.curve import failure_curve

name = "failure"
title = "Failure probability"
depends = ("seed",)

SMALLEST = 1e-6
PLAIN = 10_000


def cost(context: Context) -> int:
    """About as many evaluations."""
    return 2 * PLAIN


def compute(context: Context) -> xr.Dataset:
    """P(tau_cr < s) down to one in a million at the second correlation length."""
    setting = context.setting
    ratio = setting.correlation_ratios[1]
    found = context.listen(
        lambda tell: failure_curve(
            setting.problem,
            setting.field(ratio),
            method=LocalCriterion(),
            smallest=SMALLEST,
            target_cov=0.2,
            plain_samples=PLAIN,
            seed=context.seed,
            workers=context.workers,
            progress=False,
        ),
        0,
    )
    context.report(cost(context))
    found.attrs = {"correlation_ratio": ratio}
    return found
