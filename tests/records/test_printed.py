"""Numbers, units and quantities that prints, commands, pages and figures show, as recorded.

Words may change: a text is recorded as its numbers, and as the units and quantities between them.
"""

from __future__ import annotations

import html
import itertools
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import joint  # noqa: F401  # figures.json calls it, and the next two
import matplotlib.pyplot as plt
import numpy as np
import pytest
import sliders  # noqa: F401
import specimens  # noqa: F401
import tomli_w
import xarray as xr
from contracts import bodies, test_plots
from contracts.bodies import COEFFICIENTS, WITH_ENDS, World, world
from contracts.test_plots import DRAWN, drawn
from contracts.test_results import CALLS, LOCAL, QUIET
from contracts.test_sources import FACTORED, FIELD, OTHER, PROBLEM, source_of
from matplotlib.colors import to_rgba_array
from matplotlib.legend import Legend
from recording import WHOLE, compare, digest, read
from setups import make_problem
from user.test_notebook import objects

import stiction as st
from stiction.base.variables import unit_of_key

pytestmark = pytest.mark.filterwarnings("ignore")
RECORDS = Path(__file__).with_name("printed.json")
FIGURES = Path(__file__).with_name("figures.json")
NUMBER = r"(?<![\w.])[-\u2212]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)"
UNIT = r"(?<![\w.])[GMk\u00b5mun]?(?:Pa|N|m|s|J|Hz)(?:[ /][msk]-?\d?)?(?![\w-])"
QUANTITY = (
    "stress|force|friction|coefficient|probability|mean|deviation|variance|length|strength|slip"
    "|travel|time|position|pressure|load|weakening|quantile|interval|index|samples|points|values|noise"
)
LONGEST = 300
"""Numbers of a text that are recorded singly, at most."""
PRESSED = make_problem(width=0.01, load=st.Load(normal_pressure=2e6))
CLOSE = 0.011  # a number of three digits that is rounded the other way
MARKUP = re.compile(r"<(style|script|pre).*?</\1>|<[^>]+>", re.DOTALL)
CLOCK = re.compile(r"^ *time .*|Computed with .*|\d{4}-\d\d-\d\d|^ *computed .*", re.MULTILINE)


def tokens(text: str) -> dict[str, Any]:
    """The numbers of a text, and their order among units and quantities."""
    text = CLOCK.sub("", text)
    parts = re.findall(rf"({NUMBER})|({UNIT})|\b({QUANTITY})", text, re.IGNORECASE)
    numbers = [
        float(part[0].replace(",", "").replace("\u2212", "-")) for part in parts if part[0]
    ]
    words = " ".join("#" if part[0] else part[1] or part[2].lower() for part in parts)
    if len(numbers) > LONGEST:
        return {"numbers": digest(numbers)}
    return {"numbers": [float(f"{number:.6g}") for number in numbers], "words": words}


@pytest.fixture
def as_recorded(request):
    """Compare texts by name with those recorded."""

    def check(name: str, texts: dict[str, str]) -> None:
        record = request.config.getoption("--record")
        floor = {} if "commands" in name else {"floor": 0.0}  # commands print times, too
        shown = {
            f"{key}, {part}": value
            for key, text in texts.items()
            for part, value in tokens(text).items()
        }
        compare(RECORDS, name, shown, record, CLOSE, **floor)

    return check


@cache
def printed() -> dict[str, Any]:
    """Results and what they are of, of crooked bodies and of friction coefficients."""
    line = st.Interface(0.4, 512)
    rows = COEFFICIENTS.sample(line, samples=2, seed=3)
    answers = {
        f"{call} of {name}": CALLS[call][1](LOCAL(name))
        for call in ("failure_probability", "design_stress")
        for name in WITH_ENDS if name.split()[0] in ("line", "blocks")
    }  # fmt: skip
    kinds = {"marginal": "lognormal", "spectrum": "exponential", "noise": 0.0, "bootstrap": 20}
    kinds |= {"quantity": "friction_coefficient"}
    noisy = rows + 0.05 * np.random.default_rng(1).standard_normal(rows.shape)
    holed = np.where(np.arange(512) % 100 > 2, rows, np.nan)
    fits = {
        "fit of coefficients": st.fit_field(rows, line, **kinds, **QUIET),
        "gaps in profiles": st.fit_field(holed, line, **kinds, **QUIET),
        "fit with noise": st.fit_field(noisy, line, **kinds | {"noise": 0.05}, **QUIET),
    }
    samples = {name: world(name).problem.sample(world(name).profiles()) for name in WITH_ENDS}
    slips = st.infer(PRESSED, None, [810.0, 850.0, 790.0], unit="N", **QUIET)
    asked = {"sensitivities": False, "target_cv": 0.3} | QUIET
    several = {"method": st.LocalCriterion(), "target_cv": 0.5, "seed": 5} | QUIET
    weibull = replace(FACTORED, between={"strength": st.Weibull(mean=1.0, cv=0.15)})
    bounded = replace(FIELD, marginal=st.Gamma(mean=1e6, cv=0.2, low=5e5))
    designs = {
        "design of several": st.design_stress(
            PROBLEM, [FACTORED, weibull], probability=0.02, sensitivities=True, **several),
        "probability of several": st.failure_probability(
            PROBLEM, [FIELD, OTHER], force=455.0, **several),
        "probability of a bounded strength": st.failure_probability(
            PROBLEM, bounded, 7e5, **several),
        "design from slips": st.design_stress(PRESSED, slips, probability=1e-3, **asked),
        "probability from slips": st.failure_probability(PRESSED, slips, force=700.0, **QUIET),
    }  # fmt: skip
    sources = {name: source_of(name) for name in ("fit with scatter", "tests of two lengths")}
    return objects() | answers | samples | fits | designs | sources


def test_prints(as_recorded):
    texts = {name: str(result) for name, result in printed().items()}
    for name, result in printed().items():
        if hasattr(result, "to_dict"):
            texts[f"{name}, plain"] = repr(result.to_dict())
    as_recorded("prints", texts)


def numbers(values: Any, unit: str = "Pa", name: str = "critical_stress", **axes: Any) -> Any:
    """A result of a few numbers, along the axes of a sweep."""
    coords = {key: (key, at, {"units": unit_of_key(key, unit)}) for key, at in axes.items()}
    return xr.Dataset({name: ((*axes, "sample"), values, {"units": unit})}, coords)


def part(name: str) -> Any:
    """A figure of test_plots."""
    make, body, draw = DRAWN[name]
    return draw(make(body))


def filmed(run: xr.Dataset, frame: int) -> Any:
    """The panels of a film at one of its frames."""
    ruptures = st.plot.ruptures
    figure, moving = (ruptures._plane_film if "y" in run.dims else ruptures._line_film)(run)
    for artist, name, values in moving:
        artist.set(**{name: values[frame]})
    return figure.axes


WAVE = np.sin(np.arange(60.0)) + 0.3
SCOPE = globals() | vars(test_plots) | vars(bodies)


@pytest.mark.parametrize("call", read(FIGURES))
def test_each_figure_is_as_recorded(call, request):
    """Its numbers in SI, the words beside them, what looks alike, and the entries of legends."""
    panels = eval(call, SCOPE)
    figure, looks, colours = np.ravel(panels)[0].figure, [], {}
    texts = "\n".join(sorted(text.get_text() for text in figure.findobj(plt.Text)))
    for axes in figure.axes:
        looks += [axes.get_xscale(), axes.get_yscale(), *(one.origin for one in axes.images)]
        labels = ["", *sorted(axes.get_legend_handles_labels()[1])]
        for artist in [*axes.lines, *axes.collections, *axes.patches]:
            label = artist.get_label() in labels and labels.index(artist.get_label())
            paint = getattr(artist, "get_color", getattr(artist, "get_facecolor", None))()
            number = colours.setdefault(str(to_rgba_array(paint)[:1, :3]), len(colours))
            looks.append(f"{number}{getattr(artist, 'get_marker', str)()}{label or ''}")
    outputs = tokens(texts) | {"looks": " ".join(key for key, _ in itertools.groupby(looks))}
    outputs["inches"] = digest(figure.get_size_inches())
    outputs["legends"] = [len(legend.get_texts()) for legend in figure.findobj(Legend)]
    for n, (values, unit) in enumerate(drawn(panels)):
        outputs[f"{n} {unit}"] = digest(values)[2 * (values.size > WHOLE) :]  # without sizes
    compare(FIGURES, call, outputs, request.config.getoption("--record"), CLOSE)


def swept(w: World, **tables: Any) -> dict[str, Any]:
    """A study of two axes, the first of two lengths and the second of three pressures."""
    length = w.random.strength.spectrum.correlation_length
    sweep = [
        {"random.strength.spectrum.correlation_length": [length, 1.5 * length]},
        {"problem.load.normal_pressure": [1.9e6, 2.1e6, 2.6e6]},
    ]
    return w.plain | {"sweep": sweep, "samples": 4} | tables


@pytest.mark.parametrize("name", ["line with ends", "blocks with an extent"])
def test_commands(name, as_recorded, command, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    w = LOCAL(name)
    study = swept(w, title="Two axes")
    Path("study.toml").write_text(tomli_w.dumps(study))
    peaks = {"unit": "N", "values": [[150.0, 160.0, 171.0, 166.0]]}
    asked = {"probability": 0.1, "target_cv": 0.5}
    question = study | {"sweep": study["sweep"][1:], "reliability": asked, "peaks": peaks}
    Path("question.toml").write_text(tomli_w.dumps(question))
    texts = {}
    for line in (
        "check study.toml", "run study.toml --out run --workers 1 --part 1/2", "status run",
        "run study.toml --out run --workers 1", "status run", "report run --out page.html",
        "export run all.csv", "reliability question.toml --workers 1 --page design.html",
    ):  # fmt: skip
        _, out, errors = command(*line.split())
        texts[f"{len(texts)} {line}"] = out + errors
    texts["stored run"] = repr(st.open_run("run"))
    for page in sorted(Path().glob("*.html")):
        texts[page.name] = html.unescape(MARKUP.sub(" ", page.read_text("utf-8")))
    texts["all.csv"] = Path("all.csv").read_text("utf-8")
    as_recorded(f"commands, {name}", texts)
