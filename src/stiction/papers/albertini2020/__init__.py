"""The paper of Albertini, Karrer, Grigoriu and Kammer (2020): its system, figures and claims."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

# Public name -> module; on first use, so that the system does not cost the plotting library.
_HOMES = {
    "problem": "setting",
    "strength": "setting",
    "Setting": "setting",
    "run": "pipeline",
}

__all__ = ["Setting", "problem", "run", "strength"]

if TYPE_CHECKING:
    from stiction.papers.albertini2020.pipeline import run
    from stiction.papers.albertini2020.setting import Setting, problem, strength


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"stiction.papers.albertini2020.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'stiction.papers.albertini2020' has no attribute {name!r}")
