"""Statistics of samples: densities, quantiles, agreement with tests.

`estimates` computes means, standard deviations, quantiles and densities with errors.
`agreement` is imported from `stiction.inference` on first use. The exact moments of the
nucleation stress are in `stiction.theory`.
"""

from difflib import get_close_matches
from importlib import import_module
from typing import Any

_HOMES = {"agreement": "stiction.inference.agreement"}

__all__ = ["agreement"]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    near = "".join(f"; did you mean {other!r}?" for other in get_close_matches(name, _HOMES, 1))
    raise AttributeError(f"module 'stiction.statistics' has no attribute {name!r}{near}")


def __dir__() -> list[str]:
    return __all__
