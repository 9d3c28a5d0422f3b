"""Read studies from TOML files that may come from strangers, with the files that they name."""

from __future__ import annotations

import codecs
import json
import re
import tomllib
from pathlib import Path
from typing import Any, TypeVar

import pydantic

from stiction.base.errors import InputError, prefixed
from stiction.base.files import content_of
from stiction.base.model import FilePath, check, describe, explain, keys_of
from stiction.inference.peaks import read_peaks
from stiction.problem.profiles import ProfileFile, profile_in_file

T = TypeVar("T")
TABLES = "problem", "random", "method"
"""Tables that a study file must have."""
MAX_TOML_BYTES, MAX_TOML_WORDS, MAX_DOTS = 2**21, 2**18, 64
"""Bytes of a study file, bytes apart from lists of numbers, and dots in a line of those bytes."""
SHOWN_KEYS = 10
"""Keys in a message about a file that is no study."""
_NUMBERS = re.compile(rb"(?:[^=#]{1,200}=)?([\s\d.,eE+_\[\]-]*)")
"""A line that holds numbers, or a key and numbers."""


def check_toml(content: bytes) -> None:
    """Refuse text that Python's parser would need long for, such as keys with a thousand parts."""
    words = 0
    for line in content.split(b"\n"):
        match = _NUMBERS.fullmatch(line)
        if match and match[1].count(b".") <= match[1].count(b",") + 1:
            line = line[: match.start(1)]
        words += len(line)
        if line.count(b".") > MAX_DOTS and not line.lstrip().startswith(b"#"):
            raise InputError(
                f"has a line with more than {MAX_DOTS} dots apart from its numbers"
            )
    if words > MAX_TOML_WORDS or len(content) > MAX_TOML_BYTES:
        raise InputError(
            f"has more than {MAX_TOML_BYTES} bytes, or {MAX_TOML_WORDS} outside lists of numbers."
            " Name profiles by files next to the study, such as strength.npy"
        )


def read_toml(path: Path) -> dict[str, Any]:
    """Return the tables in a TOML file, or raise an `InputError`."""
    content = content_of(path)
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # of PowerShell 5.1
    with prefixed(str(path)):
        try:
            text = content.decode("utf-16" if wide else "utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(
                f"is not text in UTF-8 (byte {error.start}). Save it as UTF-8"
            ) from None
        check_toml(text.encode())
        try:
            return tomllib.loads(text)
        except (
            RecursionError,
            ValueError,
        ) as error:  # a ValueError for integers of many digits
            advice = "`stiction example FILE` writes a study"
            if "'\\'" in str(error):
                advice = "in paths, write / for \\, or put them in single quotes"
            raise InputError(f"is not valid TOML: {error} ({advice})") from None


def validated(
    cls: type[T], given: dict[str, Any], folder: Path | None, named: list[Path] | None = None
) -> T:
    """Validate a study in plain form. Its files are in `folder`.

    Paths of files in the study are added to `named`.
    """
    check("study", given, dict)
    if given and not {*keys_of(cls)} & {*given}:
        some = ", ".join(map(describe, [*given][:SHOWN_KEYS]))
        raise InputError(
            f"study: must have the tables {', '.join(TABLES)}, got {some}. `stiction example FILE`"
            " writes a study to start from"
        )
    files = [] if named is None else named
    context = {}
    if folder is not None:

        def read(profile: Any, name: str) -> Any:
            file = profile_in_file(profile, name, folder)
            if isinstance(file, ProfileFile):
                files.append(file.path)
            return file

        context["read"] = read
        given = dict(given)
        for key, reader in (("random", _stored_interfaces), ("peaks", read_peaks)):
            if isinstance(given.get(key), str):
                files.append(folder / check(key, given[key], FilePath))
                with prefixed(key):
                    given[key] = reader(files[-1])
    try:
        return pydantic.TypeAdapter(cls).validate_python(given, context=context)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, given)) from None


def _stored_interfaces(path: Path) -> list[Any]:
    """Return the interfaces in a file that `Study.to_toml` wrote."""
    with prefixed(str(path)):
        content = content_of(path)
        try:
            interfaces = json.loads(content)
        except (RecursionError, ValueError) as error:
            raise InputError(f"is not valid JSON: {error}") from None
        return list(check("interfaces", interfaces, list))
