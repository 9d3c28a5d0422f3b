"""The public names with parameters and defaults, kinds of study tables and commands, as text.

`python tests/public.py > tests/public.txt` stores them anew. A change belongs in CHANGELOG.md.
"""

import inspect
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import typer

import stiction
from stiction.cli.commands import app
from stiction.methods.protocol import METHODS
from stiction.problem.friction.laws import LAWS
from stiction.problem.specimen import DRIVES, SLIDER_DRIVES, SPECIMENS
from stiction.random.marginals import MARGINALS
from stiction.random.spectra import SPECTRA

KINDS = {
    "method": METHODS,
    "problem.friction": LAWS,
    "problem.specimen": SPECIMENS,
    "problem.specimen.drive": DRIVES,
    "problem.specimen.drive of a slider": SLIDER_DRIVES,
    "random.*.marginal": MARGINALS,
    "random.*.spectrum": SPECTRA,
}
"""Tables of a study whose `type` selects a class. Their keys are its parameters."""


def names_of(module: ModuleType, prefix: str) -> Iterator[str]:
    """Yield the public names of a module with their parameters and defaults."""
    for name in sorted({*module.__all__} - {"__version__"}):
        thing: Any = getattr(module, name)
        if inspect.ismodule(thing):
            yield from names_of(thing, f"{prefix}{name}.")
        elif callable(thing) and not (inspect.isclass(thing) and issubclass(thing, Exception)):
            try:
                given = inspect.signature(thing).parameters
            except (TypeError, ValueError):
                given = {}
            # Protocols and annotations have no parameters of their own.
            usual = [name if p.default is p.empty else f"{name}={p.default!r}"
                     for name, p in given.items()]  # fmt: skip
            shown = ", ".join(usual) if [*given] != ["args", "kwargs"] else ""
            yield f"{prefix}{name}({shown})"
        else:
            yield f"{prefix}{name}"


def public() -> str:
    """Return everything that code, study files and scripts of users rely on."""
    lines = list(names_of(stiction, "st."))
    lines += [f"[{table}] type = {', '.join(sorted(kinds))}" for table, kinds in KINDS.items()]
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        options = [parameter.opts[0] for parameter in command.params]
        lines.append(" ".join(["stiction", name, *options]))
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(public(), end="")
