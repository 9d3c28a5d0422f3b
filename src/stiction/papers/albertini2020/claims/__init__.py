"""The paper's statements, each with a rule that judges it by what was computed.

A claim is a function from data to `Finding` under the decorator `claim`, which says where the
paper makes it and what it says, in our own words. To add one, write the function in the module of
its subject; to add a subject, write the module and import it here.
"""

from __future__ import annotations

from stiction.papers.albertini2020.claims import (  # importing them registers their claims
    interaction,
    nucleation,
    onset,
    parameters,
    rupture,
    simulation,
    what_if,
)
from stiction.papers.albertini2020.claims.claim import (
    CLAIMS,
    SUBJECTS,
    Claim,
    Finding,
    Quantity,
    Verdict,
    claim,
    judged,
)

__all__ = [
    "SUBJECTS",
    "CLAIMS",
    "Claim",
    "Finding",
    "Quantity",
    "Verdict",
    "claim",
    "interaction",
    "judged",
    "nucleation",
    "onset",
    "parameters",
    "rupture",
    "simulation",
    "what_if",
]
