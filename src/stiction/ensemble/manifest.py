"""The manifest of a run: which study it is, and whether another one is the same run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stiction.ensemble.files import digest, printable, read_whole, write_whole
from stiction.errors import StoreError

FORMAT = 2
MANIFEST = "manifest.json"


def refuse_another(path: Path, here: Mapping[str, Any], there: Mapping[str, Any]) -> None:
    """Refuse a study that differs from the stored one in more than a growing number of samples."""
    found = differences(identity(here), identity(there))
    now, before = here["ensemble"]["samples"], there["ensemble"]["samples"]
    if now < before and not found:
        found = [f"ensemble.samples: {now} here, {before} there: a run can grow, not shrink"]
    if found:
        raise StoreError(
            f"{path}: holds another study; choose another place, or make the study the same:\n"
            + "\n".join(f"  {text}" for text in found[:20])
        )


def identity(study: Mapping[str, Any]) -> dict[str, Any]:
    """What makes two studies the same run: all but title, cluster, samples and limits."""
    result = {k: v for k, v in study.items() if k not in ("title", "cluster")}
    free = ("samples", "keep_limit")
    result["ensemble"] = {k: v for k, v in study["ensemble"].items() if k not in free}
    return result


def differences(here: Any, there: Any, path: str = "") -> list[str]:
    """Where two plain structures differ, one text each, with the path to the key."""
    if isinstance(here, Mapping) and isinstance(there, Mapping):
        texts = []
        for key in [*here, *(k for k in there if k not in here)]:
            texts += differences(here.get(key), there.get(key), f"{path}.{key}" if path else key)
        return texts
    if here == there:
        return []
    lists = isinstance(here, list) and isinstance(there, list) and len(here) == len(there)
    if lists and len(here) > 8:
        count = sum(a != b for a, b in zip(here, there, strict=True))
        return [f"{path}: {count} of {len(here)} entries differ"]
    if lists and any(isinstance(item, Mapping | list) for item in here):
        pairs = enumerate(zip(here, there, strict=True))
        return [text for i, (a, b) in pairs for text in differences(a, b, f"{path}[{i}]")]
    named = ["nothing" if value is None else _short(value) for value in (here, there)]
    return [f"{path}: {named[0]} here, {named[1]} there"]


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


class DamagedManifest(StoreError):
    """A manifest that is gone or not what was written; the study makes a new one."""


def read_manifest(path: Path) -> dict[str, Any]:
    """The manifest of a run.

    Raises
    ------
    DamagedManifest
    StoreError
        If it is of another format, or cannot be read.
    """
    data = read_whole(path / MANIFEST)
    if data is None:
        raise DamagedManifest(f"{path}: holds no run (no {MANIFEST} in it)")
    advice = "is damaged; running the study again into the folder makes a new one"
    try:
        manifest: dict[str, Any] = json.loads(data)
        said = manifest.pop("sha256", None)
        found = manifest.get("format")
    except (ValueError, AttributeError):
        raise DamagedManifest(f"{path / MANIFEST}: {advice}") from None
    if found != FORMAT and (said is None or said == _seal(manifest)):
        raise StoreError(
            f"{path}: is of format {printable(repr(found))}; this version reads {FORMAT}"
        )
    if said != _seal(manifest):
        raise DamagedManifest(f"{path / MANIFEST}: {advice}")
    return manifest


def write_manifest(path: Path, study: dict[str, Any], versions: list[str]) -> None:
    manifest = {"format": FORMAT, "study": study, "versions": versions}
    text = json.dumps(manifest | {"sha256": _seal(manifest)}, indent=1)
    write_whole(path / MANIFEST, text.encode())


def _seal(manifest: Mapping[str, Any]) -> str:
    return digest(json.dumps(manifest, sort_keys=True).encode())
