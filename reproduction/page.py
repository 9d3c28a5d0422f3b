"""The page: verdicts on the abstract, what is new, the figures, and an appendix.

The page is written whenever a figure is ready. A text whose studies are not ready is left out.
"""

import base64
import functools
import platform
import re
import time
from importlib.metadata import version
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

from reproduction import PARAMETERS, TEXTS
from reproduction.claims import CLAIMS, JINJA, NAMES, series
from reproduction.numbers_with_errors import rounded, short
from reproduction.rules import Verdict
from reproduction.runner import Data, LeftOut
from reproduction.studies import READINGS, jobs

_NAME = re.compile(r"\b(xi|tau|h|d|x|v|G|c|L)_(\w+(?:,\w+)?)")


def physics(text: str) -> Markup:
    """Return text as HTML, with symbols such as xi_0 and <tau_p> as they are printed."""
    plain = str(escape(text)).replace("&lt;", "⟨").replace("&gt;", "⟩")

    def symbol(match: re.Match) -> str:
        name, index = match.groups()
        letter = f"&{name};" if len(name) > 1 else name  # Greek letters have HTML's names
        return f"<i>{letter}</i><sub>{index}</sub>"

    plain = _NAME.sub(symbol, plain.replace("G*", "<i>G</i>*"))
    plain = re.sub(r"\b(nu|lambda)\b", r"<i>&\1;</i>", plain)
    return Markup(plain.replace(" +- ", " ± "))


JINJA.filters |= {"number": rounded, "short": short}
JINJA.filters["listed"] = lambda ratios: ", ".join(f"{ratio:g}" for ratio in ratios)
_template = functools.cache(JINJA.from_string)
_PAGE = jinja2.Environment(autoescape=True, trim_blocks=True)
_PAGE.filters |= JINJA.filters | {"physics": physics}
_page = functools.cache(_PAGE.from_string)


def write(path: Path, data: Data, images, runner, groups=None, left=(), warned=()) -> None:
    """Write the page: images by figure number, and as soon as all is done findings by title.

    `left` are claims left out with the study that each needs, `warned` the texts of warnings.
    """
    known = NAMES | {"d": data, "own": PARAMETERS, "READINGS": READINGS}

    def filled(text: str) -> str:
        """Return a text with its numbers, or nothing if one of its studies is left out."""
        try:
            return " ".join(_template(text).render(known).split())
        except LeftOut:
            return ""

    figures = [
        about | {
            "number": number,
            "image": base64.b64encode(images[number].read_bytes()).decode(),
            **{name: filled(about[name]) for name in ("ours", "caption")},
        }
        for number in images if (about := TEXTS["figure"][str(number)])
    ]  # fmt: skip
    findings = {row.claim.name: row for rows in (groups or {}).values() for row in rows}
    abstract = []
    for row in TEXTS["abstract"] if groups else ():
        claim, found = CLAIMS[row["claim"]], findings.get(row["claim"])
        abstract.append((row["sentence"], claim, found, found and series(row["number"], data)))
    computable = {name for name, *_ in jobs(full=True)}
    known |= {"texts": TEXTS, "figures": figures, "groups": groups, "abstract": abstract,
              "later": [claim for claim, study in left if study in computable],
              "never": [claim for claim, study in left if study not in computable],
              "filled": filled, "verdicts": Verdict, "runner": runner,
              "warnings": warned}  # fmt: skip
    source = Path(__file__).with_name("page.html").read_text("utf-8")
    text = _page(source).render(
        known, new=[line for line in map(filled, TEXTS["short"]) if line], version=version,
        platform=platform, seconds=time.monotonic() - runner.began,
    )  # fmt: skip
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)
