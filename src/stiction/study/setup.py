"""Problem and method of a study file, for commands that draw no samples."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pydantic

from stiction.errors import InputError, unknown_name
from stiction.model import explain
from stiction.problem import Problem
from stiction.study.study import AnyMethod, Study
from stiction.study.study_file import completed, read_sweep, read_toml, reading


def read_setup(path: Path) -> tuple[Problem, Any]:
    """The problem of a study file and its method or None; whatever else it holds is not needed.

    Of a sweep, the first values.
    """
    given, folder = read_toml(path), path.parent
    problems = [
        unknown_name("study", name, Study.__dataclass_fields__)
        for name in given
        if name not in Study.__dataclass_fields__
    ]
    sweep, _ = read_sweep(given, folder, Study)
    given = completed(given, sweep)
    if "problem" not in given:
        problems.append("problem: missing")
    found: dict[str, Any] = {}
    kinds: dict[str, Any] = {"problem": Problem, "method": AnyMethod}
    for name, kind in kinds.items():
        if name not in given:
            continue
        try:
            found[name] = pydantic.TypeAdapter(kind).validate_python(
                given[name], context=reading(folder)
            )
        except pydantic.ValidationError as error:
            problems += explain(error, Study, prefix=(name,))
    if problems:
        raise InputError(problems)
    return found["problem"], found.get("method")
