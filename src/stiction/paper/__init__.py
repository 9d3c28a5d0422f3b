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
    from stiction.paper.pipeline import run
    from stiction.paper.setting import Setting, problem, strength


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        value = getattr(import_module(f"stiction.paper.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    raise AttributeError(f"module 'stiction.paper' has no attribute {name!r}")
