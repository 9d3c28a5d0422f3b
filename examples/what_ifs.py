"""Runs the what-if studies of this folder, draws a figure of each and writes what they show.

``python examples/what_ifs.py`` writes docs/what-ifs.md and its pictures, in about five minutes;
``python examples/what_ifs.py length plane`` writes some of its parts anew.
"""

from __future__ import annotations

import dataclasses
import re
import sys
import textwrap
from collections.abc import Iterable
from pathlib import Path

from PIL import Image
from what_if_parts import PARTS

import stiction as st
from stiction.plot.style import paper_style

HERE = Path(__file__).parent
INTRODUCTION = """# What if

The discussion of Albertini et al. (2020) asks what would change if strength, spectrum, interface or
load were different. Each question is a study of its own, a TOML file in `examples/` that
`stiction check`, `run` and `report` take; `python examples/what_ifs.py` runs them all, draws these
figures and writes this page, numbers included, and `python examples/what_ifs.py correlation` one of
them. Stresses are onsets by exact equilibrium, with every interaction between patches, unless
something else is said; lines are means and shades span 5 to 95 % of the samples. Errors are one
standard error. Arrest is told without inertia unless ruptures are named. The report of
`stiction paper` asks some of the same questions of fewer or of other samples, and of the local
criterion where it says so: its numbers then differ by their errors, or by the method.
"""


def run(name: str, samples: int | None = None) -> tuple[str, object, list[str]]:
    """Title, figure and sentences of one what-if.

    Parameters
    ----------
    name : str
        ``what_if_<name>.toml`` is the study.
    samples : int, optional
        Fewer than the study asks for.
    """
    study = st.Study.from_toml(HERE / f"what_if_{name}.toml")
    draw, keep = PARTS[name]
    few = study.ensemble.samples if samples is None else samples
    ensemble = dataclasses.replace(study.ensemble, samples=few, keep=keep)
    study = dataclasses.replace(study, ensemble=ensemble)
    result = study.run(progress=True)
    with paper_style():
        figure, sentences = draw(study, result)
    return study.title, figure, sentences


def save(figure: object, path: Path) -> None:
    """With a palette instead of true colour, to keep it small."""
    with paper_style():
        figure.savefig(path, dpi=170)
    Image.open(path).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def section(name: str, title: str, sentences: list[str]) -> str:
    """What the page says of one what-if."""
    return (
        f"## {title}\n\n![{title}](images/what_if_{name}.png)\n\n"
        + textwrap.fill(" ".join(sentences), 100, break_on_hyphens=False)
        + f"\n\nStudy: `examples/what_if_{name}.toml`.\n"
    )


def main(
    folder: str | Path = HERE.parent / "docs",
    samples: int | None = None,
    names: Iterable[str] = tuple(PARTS),
) -> Path:
    """Run some, and put what they show and their pictures into the page, each as it is done."""
    folder = Path(folder)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    page = folder / "what-ifs.md"
    old = page.read_text(encoding="utf-8") if page.exists() else ""
    known = {part.partition("images/what_if_")[2].partition(".png")[0]: part
             for part in re.split(r"(?m)^(?=## )", old)[1:]}  # fmt: skip
    for name in names:
        title, figure, sentences = run(name, samples)
        save(figure, folder / "images" / f"what_if_{name}.png")
        known[name] = section(name, title, sentences)
        parts = [known[each].rstrip() + "\n" for each in PARTS if each in known]
        page.write_text("\n".join([INTRODUCTION, *parts]), encoding="utf-8")
    return page


if __name__ == "__main__":
    print(main(names=sys.argv[1:] or tuple(PARTS)))
