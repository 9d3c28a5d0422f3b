"""Results of studies kept on disk, each under a digest of everything that defines it."""

from __future__ import annotations

import hashlib
import json
import re
import warnings
from functools import cache
from importlib.resources import files
from pathlib import Path

import xarray as xr

from stiction._model import to_plain
from stiction._netcdf import DamagedError, read_dataset, write_dataset
from stiction.papers.albertini2020.registry import Study
from stiction.papers.albertini2020.studies.context import Context

FOLDER = "studies"
_WARNINGS = "accuracy_warnings"


@cache
def _sources() -> str:
    """Digest of the package: a result of other code is not the same result."""
    digest = hashlib.sha256()
    root = Path(str(files("stiction")))
    for path in sorted(root.rglob("*.py")):
        if not {"cli", "report", "figures", "claims"} & set(path.relative_to(root).parts):
            digest.update(path.read_bytes())
    return digest.hexdigest()


def place_of(study: Study, context: Context, depends: tuple[str, ...] | None = None) -> Path | None:
    """Where its result is kept, without the ending; nowhere without a folder."""
    if context.folder is None:
        return None
    if depends is None:
        depends = getattr(study, "depends", ("samples", "seed"))
    defined = {
        "study": study.name,
        "needs": [
            place.name
            for name in getattr(study, "needs", ())
            if (place := place_of(_named(name), context)) is not None
        ],
        "setting": to_plain(context.setting),
        "sources": _sources(),
        **{name: getattr(context, name) for name in depends},
    }
    text = json.dumps(defined, sort_keys=True)
    return (
        context.folder / FOLDER / f"{study.name}-{hashlib.sha256(text.encode()).hexdigest()[:16]}"
    )


def _named(name: str) -> Study:
    from stiction.papers.albertini2020.studies import STUDIES

    return STUDIES[name]


def kept(study: Study, context: Context) -> xr.Dataset | None:
    """The result of an earlier run; None if there is none, or, with a warning, a damaged one."""
    place = place_of(study, context)
    if place is None:
        return None
    path = place.with_suffix(".nc")
    try:
        dataset = read_dataset(path)
    except FileNotFoundError:
        return None
    except (OSError, DamagedError) as error:
        warnings.warn(f"{path}: {error}; this study is computed again", stacklevel=3)
        return None
    for text, count in json.loads(dataset.attrs.pop(_WARNINGS, "{}")).items():
        context.warnings[text] = count
    return dataset


def keep(study: Study, context: Context, dataset: xr.Dataset) -> None:
    """Keep a result in place of an older one of the same study, whole or not at all."""
    place = place_of(study, context)
    if place is None:
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    own = {text: count for text, count in context.warnings.items() if text.startswith(study.title)}
    write_dataset(dataset.assign_attrs({_WARNINGS: json.dumps(own)}), place.with_suffix(".nc"))
    for other in place.parent.glob("*.nc"):
        if re.fullmatch(f"{study.name}-[0-9a-f]{{16}}", other.stem) and other.stem != place.name:
            other.unlink()
