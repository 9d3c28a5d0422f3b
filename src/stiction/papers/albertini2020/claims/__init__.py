"""The paper's statements, each with a rule that judges it by what was computed.

A claim is a function from data to `Measured` under the decorator `claim`, which says where the
paper makes it, what it says, in our own words, and which rule judges the numbers. To add one,
write the function in the module of its subject; to add a subject, write the module and import it
here.
"""

from __future__ import annotations

from stiction.papers.albertini2020.claims import (  # importing them registers their claims
    arrest,
    modulus,
    nucleation,
    onset,
    parameters,
    patches,
    prediction,
    size,
    what_if,
)
from stiction.papers.albertini2020.claims.claim import (
    CLAIMS,
    SUBJECTS,
    Claim,
    Finding,
    Measured,
    Quantity,
    claim,
    judged,
)
from stiction.papers.albertini2020.claims.rules import Verdict

__all__ = [
    "SUBJECTS",
    "CLAIMS",
    "Claim",
    "Finding",
    "Measured",
    "Quantity",
    "Verdict",
    "arrest",
    "claim",
    "judged",
    "modulus",
    "nucleation",
    "onset",
    "parameters",
    "patches",
    "prediction",
    "size",
    "what_if",
]
