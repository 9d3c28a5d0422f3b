"""Parts of a run, computed by jobs that know nothing of each other, joined to one run."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from stiction._checks import as_path, check_progress
from stiction.ensemble.manifest import refuse_another
from stiction.ensemble.part import Part, part_of_name
from stiction.ensemble.store import Store
from stiction.ensemble.store_writer import writing
from stiction.errors import StoreError, warn_user
from stiction.progress import Meter, Show
from stiction.stored_run import StoredRun, folder_beside
from stiction.study.study import Study
from stiction.study_run import check_target, parts_folder, write_result

SHOWN = 8


def merge_parts(out: str | Path, *, progress: Show = True, lock: bool = True) -> StoredRun:
    """Join the parts of a run, made by ``Study.run(out=out, part=(k, n))``, to the run itself.

    What is joined is what one process would have stored, to the bit, whatever the number of parts.
    Parts are only read; parts that are missing, not finished or damaged are named in a warning, and
    the others are joined: run those again and merge again, or run the study into `out`, which
    computes what is missing.

    Parameters
    ----------
    out : path
        As it was given to the parts: a folder, or a file ending in ``.nc``, which is made when all
        is there.
    progress : bool or callable
        See `stiction.monte_carlo`.
    lock : bool
        Keep other runs out of `out` meanwhile; False for file systems that have no locks.

    Returns
    -------
    StoredRun

    Raises
    ------
    StoreError
        If there are no parts, they belong to different studies, two hold the same sample with
        different results, or `out` cannot be written.
    """
    check_progress(progress)
    path = as_path("out", out)
    parts = _stores(parts_folder(path))
    plain = _study_of(parts)
    study = Study.from_dict(plain, trusted=True)
    ensemble, points = study.ensemble, len(study.plans)
    check_target(path)
    folder = folder_beside(path) if path.suffix == ".nc" else path
    if folder != path and path.exists():
        raise StoreError(f"{path}: is there already; move it away to merge its parts anew")
    versions = sorted({version for store in parts.values() for version in store.versions})
    with writing(folder, plain, versions[-1], lock=lock) as store:
        if len(versions) > 1:
            warn_user(
                f"{parts_folder(path)}: parts were computed by different versions"
                f" ({'; '.join(versions)}): samples may differ in their last digits",
                UserWarning,
            )
        with Meter("merging", len(parts), progress, unit="parts") as meter:
            for part in parts.values():
                store.take_over(part, points, ensemble.samples, ensemble.first)
                meter.advance()
        stored = StoredRun(folder)
        if stored.missing():
            trouble = "; ".join(_incomplete(parts, points, ensemble)) or "samples were damaged"
            warn_user(f"{path}: {stored.missing()} samples are missing: {trouble}", UserWarning)
            return stored
        if folder != path:
            write_result(stored, store, path)
    return StoredRun(path)


def _stores(folder: Path) -> dict[Part, Store]:
    """The parts in a folder, in their order; what cannot be read as one is named."""
    found: dict[Part, Store] = {}
    names = sorted(entry.name for entry in folder.iterdir()) if folder.is_dir() else []
    for name in names:
        part = part_of_name(name)
        if part is None:
            continue
        try:
            found[part] = Store(folder / name)
        except StoreError as error:
            warn_user(f"{error}; run part {part.number} of {part.of} again", UserWarning)
    if not found:
        raise StoreError(
            f"{folder}: holds no parts; `stiction run STUDY.toml --out {folder.stem} --part 1/10`"
            " makes the first of ten"
        )
    return found


def _study_of(parts: dict[Part, Store]) -> dict[str, Any]:
    """The study that all parts share."""
    first = next(iter(parts.values()))
    for store in parts.values():
        refuse_another(store.path, store.study, first.study)
        here, there = (s.study["ensemble"]["samples"] for s in (store, first))
        if here != there:
            raise StoreError(
                f"{store.path}: was run with {here} samples and {first.path.name} with {there};"
                " run the parts again with the same study"
            )
    return first.study


def _incomplete(parts: dict[Part, Store], points: int, ensemble: Any) -> Iterable[str]:
    """Which parts are not there or not whole."""
    for of in sorted({part.of for part in parts}):
        absent = [k for k in range(1, of + 1) if Part(k, of) not in parts]
        if absent:
            shown = ", ".join(map(str, absent[:SHOWN])) + (", ..." if len(absent) > SHOWN else "")
            yield f"{len(absent)} of {of} parts are not there ({shown})"
    for part, store in parts.items():
        spans = store.missing(points, ensemble.samples, ensemble.first, part=part)
        damaged = len(store.verify())
        if spans or damaged:
            count = sum(span.samples for span in spans)
            text = f"{count} samples missing" if count else f"{damaged} chunks damaged"
            yield f"part {part.number} of {part.of} is not whole ({text})"
