"""How many samples a study has, which, and what is kept of them along the interface."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from stiction.errors import InputError
from stiction.model import Count, Positive, _count, describe, model, names_to_keep, whole

Number = Annotated[int, BeforeValidator(_count), Field(ge=0)]


MOST_KEPT = 10**6


def _chosen(value: Any) -> Any:
    """A number of samples stands for the first ones."""
    count = whole(value)
    if count is not None and count > MOST_KEPT:
        raise InputError(f"must be at most {MOST_KEPT} samples, got {describe(value)}")
    if count is not None and count > 0:
        return tuple(range(count))
    if not isinstance(value, list | tuple):
        raise InputError(
            "must be a list of sample numbers, or how many of the first samples to keep;"
            f" got {describe(value)}"
        )
    return tuple(value)


@model(kw_only=True)
class Ensemble:
    """How many samples, and which.

    Parameters
    ----------
    samples : int
        Number of samples.
    seed : int
        Not negative.
    first : int
        Number of the first sample.
    keep : str or tuple of str
        What is kept along the interface: random fields, such as ``"strength"``, and what the
        method can add, such as ``"slip"`` or ``"sensitivity"`` of `Equilibrium`.
    keep_samples : tuple of int or int, optional
        Numbers of the samples for which it is kept, or how many of the first; all if left out.
    keep_limit : float, optional
        Bytes that this may take in all; 1 GiB if left out.

    Examples
    --------
    >>> import stiction as st
    >>> st.Ensemble(samples=1e4, seed=1).samples
    10000
    """

    samples: Count
    seed: Number = 0
    first: Number = 0
    keep: Annotated[tuple[str, ...], BeforeValidator(names_to_keep)] = ()
    keep_samples: Annotated[tuple[Number, ...], BeforeValidator(_chosen)] | None = None
    keep_limit: Positive | None = None
