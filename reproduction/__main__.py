"""Recompute Albertini, Karrer, Grigoriu and Kammer (2020): `python reproduction`.

Computes, draws, judges and writes a page. The page exists as soon as the first figure does. A
second call computes only the missing studies.
"""

import argparse
import importlib
import os
import re
import sys
import tomllib
import warnings
from pathlib import Path

if not __package__:  # `python reproduction`
    sys.path[0] = str(Path(__file__).resolve().parent.parent)

from reproduction import PARAMETERS, TEXTS

FIGURES = TEXTS["figure"]


def main(arguments: list[str] | None = None) -> None:
    options = _options(arguments)
    import stiction as st
    from reproduction import claims, page, runner
    from reproduction.studies import jobs

    usual = runner.FULL if options.full else runner.USUAL
    size, out = runner.QUICK if options.quick else usual, options.out
    run = runner.Runner(out, size, options.seed, options.workers)
    wanted = list(jobs(options.full or options.figure is not None))
    if options.figure:
        needed = FIGURES[str(options.figure)]["needs"]
        wanted = [job for job in wanted if job[0] in needed]
    images: dict[int, Path] = {}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", st.AccuracyWarning)
        with run.started(wanted) as studies:
            data = runner.Data(studies, size)
            so_far = runner.Data(studies, size, wait=False)
            known = {"printed", *studies}  # printed results are left out with other parameters
            drawn = [int(n) for n, about in FIGURES.items() if {*about["needs"]} <= known]
            for number in [options.figure] if options.figure else drawn:
                images[number] = _draw(data, number, out / "figures")
                run.say(f"figure {number}: {images[number]}")
                if not options.figure:
                    page.write(out / "report.html", so_far, images, run)
            if options.figure:
                return
            judged, left = claims.judge_all(data)
    texts = (str(w.message) for w in caught if issubclass(w.category, st.AccuracyWarning))
    warned = sorted({re.sub(r"\d\S*", "", text): text for text in texts}.values())
    claims.write_csv(judged, out / "claims.csv")
    page.write(out / "report.html", data, images, run, judged, left, warned)
    run.say(f"done: {out / 'report.html'}")


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python reproduction", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="500 samples, for a first look")
    parser.add_argument("--full", action="store_true", help="also what needs long studies")
    parser.add_argument("--figure", type=int, metavar="N", help="draw this figure only")
    parser.add_argument("--parameters", type=Path, metavar="FILE", help="other parameters")
    parser.add_argument("--out", type=Path, default="stiction-paper", metavar="FOLDER")
    parser.add_argument("--seed", type=int, default=0)
    scheduled = hasattr(os, "sched_getaffinity")
    cores = len(os.sched_getaffinity(0)) if scheduled else os.cpu_count()
    parser.add_argument("--workers", type=int, default=cores, help="threads")
    options = parser.parse_args(arguments)
    if options.figure is not None and str(options.figure) not in FIGURES:
        parser.error(f"--figure: must be 1 to {len(FIGURES)}, got {options.figure}")
    if options.parameters:
        try:
            PARAMETERS.update(tomllib.loads(options.parameters.read_text(encoding="utf-8")))
            importlib.import_module("reproduction.setting")
        except (OSError, ValueError, importlib.import_module("stiction").UnitWarning) as error:
            text = " | ".join(str(error).splitlines())
            parser.error(f"--parameters: {options.parameters}: {text}")
        what_ifs = {path.stem for path in Path(__file__).parent.glob("what_if/*.toml")}
        if options.figure and what_ifs & {*FIGURES[str(options.figure)]["needs"]}:
            parser.error(f"--figure: {options.figure} is about what-ifs; drop --parameters")
    return options


def _draw(data, number: int, folder: Path) -> Path:
    """Draw a figure as soon as its studies are done, and return its file."""
    from reproduction.figures import beyond, common, paper
    from stiction.plot.style import paper_style

    folder.mkdir(parents=True, exist_ok=True)
    module = paper if number <= 7 else beyond
    with paper_style():
        figure = getattr(module, f"figure_{number}")(data)
        common.label(figure, FIGURES[str(number)]["panels"])
        path = folder / f"figure_{number:02}.png"
        figure.savefig(path, dpi=160)
    return path


if __name__ == "__main__":
    main()
