"""The page: eight sentences, the figures, and an appendix with statements and provenance.

The page is written whenever a figure is ready. A text whose studies are not ready is left out.
"""

import base64
import platform
import re
import time
import tomllib
from collections import Counter
from importlib.metadata import version
from pathlib import Path

import jinja2
from markupsafe import Markup, escape

import stiction as st
from reproduction import PARAMETERS, setting, texts
from reproduction.claims import Data, LeftOut, rounded, short
from reproduction.modulus import EVIDENCE, compare, odds
from reproduction.rules import Verdict

TEXTS = tomllib.loads(Path(__file__).with_name("page.toml").read_text("utf-8"))
PACKAGES = ("numpy", "scipy", "numba", "xarray", "matplotlib")
_NAME = re.compile(r"\b(xi|tau|h|d|x|v|G|c|L)_(\w+(?:,\w+)?)")


def physics(text: str) -> Markup:
    """Return text as HTML, with symbols such as xi_0 and <tau_p> as they are printed."""
    plain = (
        str(escape(text)).replace("&lt;", "⟨").replace("&gt;", "⟩").replace("G*", "<i>G</i>*")
    )

    def symbol(match: re.Match) -> str:
        name, index = match.groups()
        letter = f"&{name};" if len(name) > 1 else name  # Greek letters have HTML's names
        return f"<i>{letter}</i><sub>{index}</sub>"

    plain = _NAME.sub(symbol, plain)
    plain = re.sub(r"\b(nu|lambda)\b", r"<i>&\1;</i>", plain)
    return Markup(plain.replace(" +- ", " ± "))


def write(path: Path, data: Data, groups, images, runner, warned, *, done: bool) -> None:
    """Write the page: groups of findings by title, images by figure number, texts of warnings."""
    findings = [finding for rows in groups.values() for finding in rows]
    counts = {
        kind: Counter(f.verdict.value for f in findings if f.claim.kind == kind)
        for kind in ("arithmetic", "beyond")
    }
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    environment.filters |= {"physics": physics, "number": rounded}
    plain = jinja2.Environment(undefined=jinja2.StrictUndefined)
    plain.filters |= {"number": rounded, "short": short}
    known = texts.names(data) | {"own": bool(PARAMETERS)}

    def filled(text: str) -> str:
        """Return a text with its numbers, or nothing if one of its studies is left out."""
        try:
            return " ".join(plain.from_string(text).render(known).split())
        except LeftOut:
            return ""

    def ready(function):
        try:
            return function()
        except LeftOut:
            return None

    template = environment.from_string(Path(__file__).with_name("page.html").read_text("utf-8"))
    # The appendix, of which the readings are a part, is written at the end only.
    readings = (ready(lambda: compare(data)) if done else None) or []
    order = [Verdict.FAILS, Verdict.TEXT, Verdict.OPEN, Verdict.CORRECTED]
    exceptions = [f for f in findings if f.verdict in order]
    exceptions.sort(key=lambda f: order.index(f.verdict))
    title = "What does not hold, is undecided, or holds only with a correction"
    sections = [(title, exceptions, True)]
    sections += [(title, rows, False) for title, rows in groups.items() if rows]
    text = template.render(
        version=st.__version__,
        own=PARAMETERS,
        short=[line for line in map(filled, TEXTS["short"]) if line],
        done=done,
        verdicts=Verdict,
        findings=[f.verdict for f in findings if f.claim.kind == "finding"],
        others={
            kind: f"{sum(row.values())} ({', '.join(f'{n} {v}' for v, n in row.items())})"
            for kind, row in counts.items()
        },
        resting=sum(bool(f.otherwise) for f in findings if f.claim.kind == "finding"),
        texts=TEXTS,
        figures=[_figure(number, image, filled) for number, image in images.items()],
        few=ready(lambda: texts.few_and_many(data)),
        readings=readings,
        best=max((float(reading.likelihood[0]) for reading in readings), default=0.0) or 1.0,
        evidence=[(what, where) for what, where, _ in EVIDENCE],
        odds=readings and odds(data),
        odds_of_counts=readings and odds(data, slice(3)),
        odds_otherwise=readings and [odds(data, visible=visible)[0] for visible in (0.5, 2.0)],
        claims=sections,
        setting=setting,
        taken={
            name.replace("_", " ").replace("-", " with "): data[name].sizes["sample"]
            for name in data.studies
            if name in data and "sample" in data[name].dims
        },
        size=data.size,
        runner=runner,
        seconds=time.monotonic() - runner.began,
        versions={name: version(name) for name in PACKAGES},
        platform=platform,
        warnings=warned,
    )
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)


def _figure(number: int, image: Path, filled) -> dict:
    encoded = base64.b64encode(image.read_bytes()).decode()
    about = TEXTS["figure"][str(number)]
    return about | {
        "number": number,
        "ours": filled(about["ours"]),
        "caption": filled(about["caption"]),
        "image": f"data:image/png;base64,{encoded}",
    }
