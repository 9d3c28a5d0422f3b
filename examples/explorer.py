"""An explorer: sliders for one kind of interface, with an onset and a thousand others beside them.

    python -m pip install panel
    python examples/explorer.py

It is served on 127.0.0.1 only; Ctrl-C ends it. `Setting` and `Cached` compute, `Explorer` draws.
"""

from __future__ import annotations

import io
import math
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import panel as pn
import scipy.stats
import tomli_w
from bokeh.models import ColumnDataSource, Legend
from bokeh.plotting import figure

import stiction as st
from stiction.plot.style import ACCENT, INK, QUIET, color

Array = np.ndarray

SAMPLES = 1000
SHOWN_NODES = 20
"""Nodes in a nucleation length; the local criterion needs 16."""
FEWEST, MOST = 256, 4096
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")

_ALPHA, _BETA = 1.5, 3.0
_BETA_MEAN = _ALPHA / (_ALPHA + _BETA)
_BETA_SD = math.sqrt(_ALPHA * _BETA / (_ALPHA + _BETA + 1.0)) / (_ALPHA + _BETA)


def _beta(mean: float, sd: float) -> Any:
    """Of the shape in Albertini et al. (2020)."""
    low = mean - _BETA_MEAN * sd / _BETA_SD
    return st.Beta(alpha=_ALPHA, beta=_BETA, low=low, high=low + sd / _BETA_SD)


def _uniform(mean: float, sd: float) -> Any:
    half = math.sqrt(3.0) * sd
    return st.Beta(alpha=1.0, beta=1.0, low=mean - half, high=mean + half)


def _lognormal(mean: float, sd: float) -> Any:
    s = math.sqrt(math.log1p((sd / mean) ** 2))
    return scipy.stats.lognorm(s, scale=mean * math.exp(-0.5 * s * s))


MARGINALS: dict[str, Callable[[float, float], Any]] = {
    "beta": _beta,
    "uniform": _uniform,
    "lognormal": _lognormal,
}


@dataclass(frozen=True)
class Setting:
    """What the sliders say: lengths in mm, stresses in MPa, the critical slip in um.

    The critical slip is that at the mean strength; with it and the two strengths goes the weakening
    rate, which is uniform. `load` is the share of the exact onset at which slip is shown.
    """

    correlation_length: float = 1.5
    marginal: str = "beta"
    mean: float = 1.0
    spread: float = 0.2
    residual: float = 0.0
    critical_slip: float = 2.0
    pressure: float = 5.0
    length: float = 100.0
    sample: int = 0
    load: float = 0.98

    @property
    def weakening_rate(self) -> float:
        """(mean strength - residual strength)/critical slip, Pa/m."""
        if self.residual >= self.mean:
            raise st.InputError(
                f"residual strength: {self.residual:g} MPa is not below the mean strength,"
                f" {self.mean:g} MPa; nothing would weaken"
            )
        return (self.mean - self.residual) * 1e6 / (self.critical_slip * 1e-6)

    @property
    def nodes(self) -> int:
        """A power of two that resolves the nucleation length and all of the spectrum."""
        h_n = 2.0 * 0.5788869418506 * SOLID.effective_modulus("II") / self.weakening_rate
        waves = (
            2.0
            * st.PowerLawSpectrum(correlation_length=self.correlation_length).cutoff()
            / (2.0 * math.pi)
        )
        wanted = max(SHOWN_NODES * self.length * 1e-3 / h_n, waves * self.length)
        return int(np.clip(2 ** math.ceil(math.log2(wanted)), FEWEST, MOST))

    def problem(self) -> st.Problem:
        """Everything that is not random."""
        return st.Problem(
            solid=SOLID,
            interface=st.Interface(length=self.length * 1e-3, nodes=self.nodes),
            friction=st.LinearWeakening(
                weakening_rate=self.weakening_rate, residual_strength=self.residual * 1e6
            ),
            load=st.Load(normal_pressure=self.pressure * 1e6),
        )

    def strength(self) -> st.RandomField:
        """The random strength."""
        return st.RandomField(
            marginal=MARGINALS[self.marginal](self.mean * 1e6, self.spread * 1e6),
            spectrum=st.PowerLawSpectrum(correlation_length=self.correlation_length * 1e-3),
        )

    def study(self) -> st.Study:
        """The thousand samples as a study."""
        return st.Study(
            problem=self.problem(),
            random=self.strength(),
            method=st.LocalCriterion(),
            ensemble=st.Ensemble(samples=SAMPLES, seed=0),
            title="From the explorer",
        )

    def toml(self) -> str:
        """The study as a file for `stiction run`."""
        return tomli_w.dumps(self.study().to_dict())


class Answer(NamedTuple):
    """What is drawn: positions in mm, stresses in MPa, slip in um, coefficients in rising order."""

    x: Array
    strength: Array
    average: Array
    stress: Array
    slip: Array
    place: float
    onset: float
    coefficients: Array
    doubts: tuple[str, ...]


class Cached:
    """The answers to settings; what a slider does not change is not computed again."""

    def __init__(self) -> None:
        self._many: tuple[Any, Array] | None = None
        self._one: tuple[Any, tuple[Any, ...]] | None = None

    def answer(self, setting: Setting) -> Answer:
        """All that is shown."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            problem, strength = setting.problem(), setting.strength()
            coefficients = self._coefficients(problem, strength)
            tau_p, average, exact = self._profile(problem, strength, setting.sample)
            load = setting.load * float(exact.first_instability[0])
            path = st.equilibrium_path(problem, tau_p, [load])
        doubts = tuple(dict.fromkeys(str(warning.message) for warning in caught))
        return Answer(
            x=problem.interface.x * 1e3,
            strength=tau_p * 1e-6,
            average=average * 1e-6,
            stress=path.stress.values[0] * 1e-6,
            slip=path.slip.values[0] * 1e6,
            place=float(exact.critical_position[0]) * 1e3,
            onset=float(exact.critical_stress[0]) * 1e-6,
            coefficients=coefficients,
            doubts=doubts,
        )

    def _coefficients(self, problem: st.Problem, strength: st.RandomField) -> Array:
        key = problem, strength
        if self._many is None or self._many[0] != key:
            method = st.LocalCriterion()
            found = st.monte_carlo(
                problem,
                strength,
                method=method,
                samples=SAMPLES,
                seed=0,
                pilot=False,
                progress=False,
            )
            self._many = key, np.sort(found.friction_coefficient.values)
        return self._many[1]

    def _profile(
        self, problem: st.Problem, strength: st.RandomField, sample: int
    ) -> tuple[Any, ...]:
        key = problem, strength, sample
        if self._one is None or self._one[0] != key:
            tau_p = strength.sample(problem.interface, samples=1, first=sample, seed=0)[0]
            exact = st.onset(problem, tau_p, method=st.Equilibrium(), progress=False)
            self._one = key, (tau_p, st.theory.nucleation_stress(problem, tau_p), exact)
        return self._one[1]


_SLIDERS: dict[str, tuple[str, float, float, float]] = {
    "correlation_length": (
        "correlation length (mm)",
        0.3,
        15.0,
        0.1,
    ),
    "mean": ("mean strength (MPa)", 0.5, 2.0, 0.05),
    "spread": ("standard deviation of the strength (MPa)", 0.02, 0.4, 0.01),
    "residual": ("residual strength (MPa)", 0.0, 0.6, 0.02),
    "critical_slip": ("critical slip at the mean strength (\N{MICRO SIGN}m)", 0.5, 6.0, 0.1),
    "pressure": ("normal pressure (MPa)", 1.0, 20.0, 0.5),
    "length": ("length of the interface (mm)", 20.0, 200.0, 5.0),
    "load": ("load, as a share of the onset", 0.7, 0.999, 0.001),
}
_WIDTH = 300
_SOON = 30
"""Milliseconds in which further moves of a slider are gathered."""
_CELLS = 40


class Explorer:
    """One visitor's page."""

    def __init__(self) -> None:
        start = Setting()
        self._cached, self._due = Cached(), False
        self.sliders = {
            name: pn.widgets.FloatSlider(
                name=text, start=low, end=high, step=step, value=getattr(start, name),
                width=_WIDTH, format="0[.]000",
            )
            for name, (text, low, high, step) in _SLIDERS.items()
        }  # fmt: skip
        self.marginal = pn.widgets.Select(
            name="distribution of the strength", options=list(MARGINALS), width=_WIDTH
        )
        self.sample = pn.widgets.IntSlider(name="sample shown", start=0, end=99, width=_WIDTH)
        self.words, self.doubts = pn.pane.HTML(""), pn.pane.Alert(visible=False)
        self.profile, self.slip, self.density, self.tail = (
            ColumnDataSource() for _ in range(4)
        )
        self.place = ColumnDataSource({"x": [], "y": []})
        save = pn.widgets.FileDownload(
            callback=self._file, filename="study.toml", label="save as study", width=_WIDTH
        )
        for widget in (*self.sliders.values(), self.marginal, self.sample):
            widget.param.watch(self._moved, "value")
        self.view = pn.FlexBox(
            pn.Column(
                "# Explorer", *self.sliders.values(), self.marginal, self.sample, save, width=340
            ),
            pn.Column(
                self.words,
                self.doubts,
                *(pn.pane.Bokeh(one, sizing_mode="stretch_width") for one in self._figures()),
                sizing_mode="stretch_width",
                styles={"flex": "1 1 340px", "min-width": "0"},
            ),
            sizing_mode="stretch_width",
        )  # fmt: skip
        self.show()

    def setting(self) -> Setting:
        """What the sliders say now."""
        values = {name: slider.value for name, slider in self.sliders.items()}
        return Setting(marginal=self.marginal.value, sample=self.sample.value, **values)

    def _moved(self, *events: Any) -> None:
        """Soon, and once for all moves that come until then."""
        if self._due:
            return
        document = pn.state.curdoc
        if document is None or document.session_context is None:
            self.show()
            return
        self._due = True
        document.add_timeout_callback(self._later, _SOON)

    def _later(self) -> None:
        self._due = False
        self.show()

    def show(self) -> None:
        """Compute and draw; what does not fit together is said, and the old pictures stay."""
        begin = time.perf_counter()
        try:
            setting = self.setting()
            answer = self._cached.answer(setting)
        except st.InputError as error:
            self._say("danger", error.problems)
            return
        self._draw(setting, answer)
        self._say("warning", answer.doubts)
        low, middle, high = np.quantile(answer.coefficients, [0.05, 0.5, 0.95])
        self.words.object = (
            f"<p id='answer'>static friction coefficient <b>{middle:.4f}</b> (median of"
            f" {SAMPLES:,}), 5 to 95 %: {low:.4f} to {high:.4f}.<br>The sample shown slides at"
            f" {answer.onset:.4f} MPa, {answer.onset / setting.pressure:.4f}; it begins at"
            f" {answer.place:.1f} mm. Nucleation length"
            f" {setting.problem().nucleation_length * 1e3:.2f} mm,"
            f" {setting.nodes} nodes; {1e3 * (time.perf_counter() - begin):.0f} ms.</p>"
        )

    def _say(self, kind: str, texts: Any) -> None:
        self.doubts.param.update(
            object="\n\n".join(texts), alert_type=kind, visible=bool(tuple(texts))
        )

    def _file(self) -> io.BytesIO:
        return io.BytesIO(self.setting().toml().encode())

    def _draw(self, setting: Setting, answer: Answer) -> None:
        self.profile.data = {
            "x": answer.x,
            "strength": answer.strength,
            "average": answer.average,
            "stress": answer.stress,
        }
        self.slip.data = {"x": answer.x, "slip": answer.slip}
        self.place.data = {"x": [answer.place], "y": [answer.onset]}
        counts, edges = np.histogram(answer.coefficients, _CELLS, density=True)
        self.density.data = {"left": edges[:-1], "right": edges[1:], "top": counts}
        self.tail.data = {
            "mu": answer.coefficients,
            "share": (np.arange(SAMPLES) + 1.0) / SAMPLES,
        }

    def _figures(self) -> list[Any]:
        options: dict[str, Any] = {
            "height": 210,
            "toolbar_location": None,
            "sizing_mode": "stretch_width",
        }
        wide = figure(**options, y_axis_label="MPa", title="strength and shear stress")
        wide.line("x", "strength", source=self.profile, color=QUIET, legend_label="strength")
        wide.line(
            "x", "average", source=self.profile, color=INK, line_width=2,
            legend_label="nucleation stress",
        )  # fmt: skip
        wide.line(
            "x", "stress", source=self.profile, color=color(2), legend_label="shear stress now"
        )
        wide.scatter(
            "x", "y", source=self.place, color=ACCENT, size=10, legend_label="exact onset"
        )
        patches = figure(
            **options, x_range=wide.x_range, title="slip patches at this load",
            x_axis_label="position (mm)", y_axis_label="slip (\N{MICRO SIGN}m)",
        )  # fmt: skip
        patches.varea("x", 0, "slip", source=self.slip, color=ACCENT, alpha=0.7)
        patches.y_range.start = 0.0
        spread = figure(
            **options, y_axis_label="density",
            title=f"friction coefficient of {SAMPLES:,} samples, local criterion",
        )  # fmt: skip
        spread.quad(
            left="left", right="right", bottom=0, top="top", source=self.density,
            color=color(1), line_color="white",
        )  # fmt: skip
        tail = figure(
            **options, x_range=spread.x_range, y_axis_type="log", y_axis_label="share below",
            x_axis_label="static friction coefficient", title="lower tail",
        )  # fmt: skip
        tail.step("mu", "share", source=self.tail, color=color(1), line_width=2, mode="after")
        for one in (wide, patches, spread, tail):
            one.title.text_font_style = "normal"
            for legend in one.select(Legend):
                legend.ncols = 2
                legend.background_fill_alpha = 0.6
                legend.label_text_font_size = "8pt"
                legend.padding = 2
        wide.add_layout(wide.legend[0], "below")
        return [wide, patches, spread, tail]


def page() -> Any:
    """A new page, for one visitor."""
    return Explorer().view


if __name__ == "__main__":
    pn.extension(design="native")
    pn.serve(page, port=5006, address="127.0.0.1", show=True, title="stiction explorer")
