"""The page: findings first, then departures, figures, statements and provenance."""

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
from reproduction import setting, texts
from reproduction.claims import Data, rounded
from reproduction.modulus import compare
from reproduction.rules import Verdict

TEXTS = tomllib.loads(Path(__file__).with_name("page.toml").read_text("utf-8"))
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


def write(path: Path, data: Data, groups, images, runner, warned) -> None:
    """Write the page: groups of findings by title, images by figure number, texts of warnings."""
    found = [finding for rows in groups.values() for finding in rows]
    arithmetic = Counter(f.verdict.value for f in found if f.claim.kind == "arithmetic")
    environment = jinja2.Environment(autoescape=True, trim_blocks=True)
    environment.filters |= {"physics": physics, "number": rounded}
    template = environment.from_string(Path(__file__).with_name("page.html").read_text("utf-8"))
    readings = compare(data)
    exceptions = [f for f in found if f.verdict in (Verdict.FAILS, Verdict.CORRECTED)]
    exceptions.sort(key=lambda f: f.verdict is not Verdict.FAILS)
    sections = [("What does not hold, or only with a correction", exceptions, True)]
    sections += [(title, rows, False) for title, rows in groups.items()]
    text = template.render(
        version=st.__version__,
        samples=f"{data.size.samples:,}",
        ruptures=data.size.ruptures,
        short=texts.in_short(data),
        total=len(found),
        verdicts=Verdict,
        findings=[f.verdict for f in found if f.claim.kind == "finding"],
        arithmetic=", ".join(f"{count} {verdict}" for verdict, count in arithmetic.items()),
        departures=TEXTS["departure"],
        figures=[_figure(number, image, data) for number, image in images.items()],
        few=texts.few_and_many(data),
        readings=readings,
        best=max(reading.likelihood for reading in readings) or 1.0,
        claims=sections,
        not_judged=TEXTS["not_judged"],
        errata=TEXTS["erratum"],
        provenance=_provenance(data, runner),
        warnings=warned,
    )
    unfinished = path.with_suffix(".unfinished")
    unfinished.write_text(text, encoding="utf-8")
    unfinished.replace(path)


def _figure(number: int, image: Path, data: Data) -> dict:
    encoded = base64.b64encode(image.read_bytes()).decode()
    about = TEXTS["figure"][str(number)]
    return about | {
        "number": number,
        "ours": texts.OURS[number](data),
        "image": f"data:image/png;base64,{encoded}",
    }


def _provenance(data: Data, runner) -> list[tuple[str, str]]:
    problem, size = setting.PROBLEM, data.size
    spacing = problem.interface.spacing
    packages = ("numpy", "scipy", "numba", "xarray", "matplotlib")
    return [
        ("Solid", "G = 1 GPa, nu = 0.33, rho = 1170 kg/m³, plane stress, mode II;"
         f" G* = {setting.G_STAR * 1e-9:.3f} GPa"),
        ("Interface", f"L = {setting.L:g} m, {problem.interface.size} nodes;"
         f" h_n = {setting.H * 1e3:.3f} mm, {setting.H / spacing:.1f} nodes"),
        ("Strength", f"Beta(1.5, 3) between {setting.LOW * 1e-6:g} and {setting.HIGH * 1e-6:g} MPa;"
         f" mean {setting.MEAN * 1e-6:.4f}, standard deviation"
         f" {setting.DEVIATION * 1e-6:.4f} MPa"),
        ("Samples", f"{size.samples:,} at each of four correlation lengths, seed {runner.seed};"
         f" {size.trend:,} a point over the wide range; {size.what_if} a what-if by equilibrium"),
        ("Ruptures", f"{size.ruptures} at each of three correlation lengths;"
         f" {size.arrests} a what-if; {size.dynamic:,} at each correlation length in the Monte"
         " Carlo study by elastodynamics" + ("" if size.dynamic else " (with --full: 1,000)")),
        ("Versions", f"stiction {st.__version__}, Python {platform.python_version()}, "
         + ", ".join(f"{name} {version(name)}" for name in packages)),
        ("Time", f"{time.monotonic() - runner.began:.0f} s by {runner.workers} threads on"
         f" {platform.system()}, {platform.machine()}"),
    ]  # fmt: skip
