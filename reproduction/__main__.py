"""Recompute Albertini, Karrer, Grigoriu and Kammer (2020): `python reproduction`.

Computes, draws, judges and writes a page. A second call completes what is missing.
"""

import argparse
import dataclasses
import importlib
import os
import re
import sys
import tomllib
import warnings
from pathlib import Path

if not __package__:  # `python reproduction`
    sys.path[0] = str(Path(__file__).resolve().parent.parent)

from reproduction import PARAMETERS


def main(arguments: list[str] | None = None) -> None:
    """Run the command."""
    options = _options(arguments)
    import stiction as st
    from reproduction import claims, modulus, page, runner, statements_onset, statements_rupture
    from reproduction.runner import FULL, QUICK, USUAL
    from reproduction.studies import jobs

    size = QUICK if options.quick else FULL if options.full else USUAL
    if options.samples:
        names = ("readings", "trend", "what_if", "dynamic")  # lowered too, but not raised
        others = {name: min(options.samples, getattr(size, name)) for name in names}
        size = dataclasses.replace(size, samples=options.samples, **others)
    out = Path(options.out)
    run = runner.Runner(out, size, options.seed, options.workers)
    rows = statements_onset.GROUPS | statements_rupture.GROUPS
    rows |= {"Which modulus": modulus.CLAIMS}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", st.AccuracyWarning)
        with run.started(jobs(size)) as studies:
            data = claims.Data(studies, size)
            images = _draw(run, data, page.TEXTS["figure"], out / "figures")
            groups = {
                title: [one for claim in each if (one := claims.judge(claim, data))]
                for title, each in rows.items()
            }
    texts = (str(w.message) for w in caught if issubclass(w.category, st.AccuracyWarning))
    warned = sorted({re.sub(r"\d\S*", "", text): text for text in texts}.values())
    claims.write_csv([found for each in groups.values() for found in each], out / "claims.csv")
    page.write(out / "report.html", data, groups, images, run, warned)
    run.say(f"done: {out / 'report.html'}")


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python reproduction", description=__doc__)
    level = parser.add_mutually_exclusive_group()
    level.add_argument("--quick", action="store_true", help="500 samples, for a first look")
    level.add_argument("--full", action="store_true",
                       help="also ruptures by the thousand; some six minutes more")  # fmt: skip
    parser.add_argument("--samples", type=int, metavar="N",
                        help="of each correlation length, 100 or more")  # fmt: skip
    parser.add_argument("--parameters", type=Path, metavar="FILE",
                        help="TOML, in SI units, such as length = 0.2")  # fmt: skip
    parser.add_argument("--out", default="stiction-paper", metavar="FOLDER")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=_cores(), help="threads")
    options = parser.parse_args(arguments)
    if options.samples is not None and options.samples < 100:
        parser.error(f"--samples: must be 100 or more, got {options.samples}")
    if options.parameters:
        try:
            PARAMETERS.update(tomllib.loads(options.parameters.read_text(encoding="utf-8")))
            importlib.import_module("reproduction.setting")
        except (OSError, ValueError) as error:
            parser.error(f"--parameters: {options.parameters}: {error}")
    return options


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()


def _draw(run, data, texts: dict, folder: Path) -> dict:
    """Draw figures as soon as their studies are done."""
    import stiction as st
    from reproduction.figures import beyond, paper

    folder.mkdir(parents=True, exist_ok=True)
    images = {}
    with st.plot.paper_style():
        for key, about in texts.items():
            if not {*about.get("needs", ())} <= {*data.studies}:
                continue
            number, module = int(key), paper if int(key) <= 7 else beyond
            images[number] = folder / f"figure_{number:02}.png"
            figure = getattr(module, f"figure_{number}")(data)
            run.say(f"figure {number}")
            figure.savefig(images[number], dpi=200)
    return images


if __name__ == "__main__":
    main()
