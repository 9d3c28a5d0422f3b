"""The page: eight sentences, the figures, and an appendix with statements and provenance.

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

from reproduction import PARAMETERS, TEXTS, modulus
from reproduction.claims import GROUPS, JINJA, NAMES, judge
from reproduction.numbers_with_errors import rounded, short
from reproduction.rules import Verdict, below
from reproduction.runner import Data, LeftOut

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


OUTCOMES = {Verdict[name]: text for name, text in TEXTS["outcome"].items()}


def outcome(data: Data, name: str) -> str:
    """Return the verdict on a statement as the beginning of a sentence."""
    (claim,) = (claim for rows in GROUPS.values() for claim in rows if claim.name == name)
    if (finding := judge(claim, data)) is None:
        raise LeftOut(name)
    return OUTCOMES[finding.verdict]


def write(path: Path, data: Data, groups, images, runner, warned, *, done: bool) -> None:
    """Write the page: groups of findings by title, images by figure number, texts of warnings."""
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    JINJA.filters |= {"number": rounded, "short": short}
    environment.filters |= JINJA.filters | {"physics": physics}
    known = NAMES | {"d": data, "own": PARAMETERS, "OUTCOMES": OUTCOMES, "below": below}
    known["outcome"] = functools.partial(outcome, data)

    def filled(text: str) -> str:
        """Return a text with its numbers, or nothing if one of its studies is left out."""
        try:
            return " ".join(JINJA.from_string(text).render(known).split())
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
    template = environment.from_string(Path(__file__).with_name("page.html").read_text("utf-8"))
    known |= {"texts": TEXTS, "figures": figures, "groups": groups, "done": done}
    known |= {"verdicts": Verdict, "modulus": modulus, "runner": runner, "warnings": warned}
    text = template.render(
        known, short=[line for line in map(filled, TEXTS["short"]) if line], version=version,
        platform=platform, seconds=time.monotonic() - runner.began,
    )  # fmt: skip
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)
