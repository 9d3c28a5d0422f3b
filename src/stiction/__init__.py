"""Statistics of static friction: the load and place at which a rough interface begins to slide."""

import re
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any

__version__ = "1.0.0"

# The stub lists the public names, and editors read it, too. Each name
# is imported on first use, so that `import stiction` is quick.
_STUB = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
_HOMES = {
    name: home
    for home, name in re.findall(r"^from (stiction.*) import (\w+) as", _STUB, re.MULTILINE)
}
__all__ = ["__version__", *_HOMES]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        near = get_close_matches(name, _HOMES, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise AttributeError(f"module 'stiction' has no attribute {name!r}{hint}")
    home = _HOMES[name]
    if home == __name__:
        return import_module(f"{home}.{name}")
    value = globals()[name] = getattr(import_module(home), name)
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
