"""The page of the explorer: sliders on the left, an interface and a thousand onsets beside them."""

from __future__ import annotations

import io
import socket
import time
from typing import Any

import numpy as np
import panel as pn
from bokeh.models import ColumnDataSource, Legend
from bokeh.plotting import figure

from stiction.errors import InputError
from stiction.explorer.setting import MARGINALS, SAMPLES, Answer, Cached, Setting
from stiction.plot.style import ACCENT, INK, QUIET, color

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
HOST = "127.0.0.1"
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
        self.code = pn.pane.Markdown("", sizing_mode="stretch_width")
        self.profile, self.slip, self.density, self.tail = (ColumnDataSource() for _ in range(4))
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
                pn.Card(
                    self.code, title="show me the code", collapsed=True,
                    sizing_mode="stretch_width",
                ),
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
            code = setting.code()
        except InputError as error:
            self._say("danger", error.problems)
            return
        self._draw(setting, answer)
        self._say("warning", answer.doubts)
        self.code.object = f"```python\n{code}```"
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
        wide.scatter("x", "y", source=self.place, color=ACCENT, size=10, legend_label="exact onset")
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


def serve(port: int, *, show: bool, background: bool = False) -> Any:
    """Serve the page on this machine only, until it is interrupted.

    Parameters
    ----------
    port : int
    show : bool
        Open a browser.
    background : bool
        Return the server, that runs in a thread and has a method `stop`.
    """
    pn.extension(design="native")
    return pn.serve(
        page, port=port, address=HOST, show=show, title="stiction explorer",
        threaded=background, verbose=not background,
        websocket_origin=[f"{HOST}:{port}", f"localhost:{port}"],  # no other page may talk to it
    )  # fmt: skip


def free_port() -> int:
    """A port on which nothing listens now."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        number: int = probe.getsockname()[1]
    return number
