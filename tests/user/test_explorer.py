"""The explorer: what it shows is what its code and its study file compute; and a real browser."""

import io
import sys
import tomllib

import browser
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest

import stiction as st
from stiction.explorer.setting import MARGINALS, Cached, Setting

SETTINGS = {
    "beta": Setting(length=50.0, residual=0.1),
    "lognormal": Setting(length=50.0, marginal="lognormal", sample=2, load=0.9),
}


@pytest.mark.parametrize("name", MARGINALS)
def test_marginals_have_the_mean_and_spread_of_the_sliders(name):
    marginal = MARGINALS[name](1e6, 0.2e6)
    frozen = getattr(marginal, "distribution", marginal)
    assert frozen.mean() == pytest.approx(1e6)
    assert frozen.std() == pytest.approx(0.2e6)


@pytest.mark.parametrize("name", SETTINGS)
def test_the_code_computes_what_is_shown(name):
    setting = SETTINGS[name]
    answer = Cached().answer(setting)
    scope = {}
    with mpl.rc_context({"backend": "agg"}):
        exec(setting.code(), scope)
        plt.close("all")
    shown = np.sort(scope["many"].friction_coefficient.values)
    np.testing.assert_array_equal(shown, answer.coefficients)
    assert scope["exact"].critical_stress.item() * 1e-6 == answer.onset
    np.testing.assert_array_equal(scope["path"].slip.values[0] * 1e6, answer.slip)
    study = st.Study.from_dict(tomllib.loads(setting.toml()))
    assert study == setting.study()


def test_only_what_depends_on_a_slider_is_computed_again():
    cached = Cached()
    first = cached.answer(SETTINGS["beta"])
    again = cached.answer(Setting(length=50.0, residual=0.1, load=0.8))
    assert again.coefficients is first.coefficients
    assert again.slip.max() < first.slip.max()  # patches grow with the load


def test_what_does_not_fit_together_is_said():
    with pytest.raises(st.InputError, match=r"0\.6 MPa is not below the mean strength, 0\.5 MPa"):
        Cached().answer(Setting(mean=0.5, residual=0.6))


def test_the_page_without_a_browser():
    pytest.importorskip("panel")
    from stiction.explorer.page import Explorer

    page = Explorer()
    before = page.words.object
    page.sliders["correlation_length"].value = 4.0
    assert page.words.object != before
    kept = page.words.object
    page.sliders["mean"].value = 0.5
    page.sliders["residual"].value = 0.6
    assert page.doubts.visible
    assert "not below the mean" in page.doubts.object
    assert page.words.object != kept  # of the mean, before the residual strength
    page.sliders["residual"].value = 0.0
    assert not page.doubts.visible
    assert isinstance(page._file(), io.BytesIO)


def test_it_listens_on_this_machine_only(monkeypatch):
    panel = pytest.importorskip("panel")
    from stiction.explorer.page import serve

    given = {}
    monkeypatch.setattr(panel, "serve", lambda *_, **options: given.update(options))
    serve(5006, show=False)
    assert given["address"] == "127.0.0.1"
    assert given["websocket_origin"] == ["127.0.0.1:5006", "localhost:5006"]


@pytest.mark.parametrize(
    ("arguments", "panel", "said"),
    [
        (["--port", "70000"], True, "--port: must lie between 0 and 65535, got 70000"),
        (["--no-browser"], False, "needs panel, which is not installed: python -m pip install"),
    ],
)
def test_the_command_says_what_is_wrong(arguments, panel, said, monkeypatch, capsys):
    from stiction.cli import app

    monkeypatch.setattr("importlib.util.find_spec", lambda name: "there" if panel else None)
    monkeypatch.setattr(sys, "argv", ["stiction", "explore", *arguments])
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == 2
    assert said in capsys.readouterr().err


FIND = """
(() => {
  const all = (root) => [...root.querySelectorAll('*')].flatMap(
    (one) => one.shadowRoot ? [one, ...all(one.shadowRoot)] : [one]);
  return all(document);
})()
"""
ANSWER = f"({FIND}.find((one) => one.id == 'answer') || {{}}).innerText"
HANDLE = f"""
(() => {{
  const box = {FIND}.filter((one) => one.classList.contains('noUi-handle'))[0]
    .getBoundingClientRect();
  return [box.x + box.width / 2, box.y + box.height / 2];
}})()
"""

CODE = f"""
{FIND}.some((one) => one.tagName == 'CODE' && one.getBoundingClientRect().height > 0
  && one.innerText.includes('st.Problem('))
"""


@pytest.mark.slow
@pytest.mark.skipif(browser.program() is None, reason="there is no Chromium")
@pytest.mark.parametrize("width", [1280, 390])
def test_a_slider_moves_the_figure_in_a_real_browser(width, tmp_path):
    pytest.importorskip("panel")
    from stiction.explorer.page import free_port, serve

    port = free_port()
    server = serve(port, show=False, background=True)
    try:
        with browser.Browser() as page:
            page.size(width)
            page.open(f"http://127.0.0.1:{port}/")
            before = page.until(ANSWER)
            page.until(f"{FIND}.filter((one) => one.tagName == 'CANVAS').length >= 4")
            # Nothing is wider than the window.
            assert page.ask("document.documentElement.scrollWidth") <= width
            first = page.picture()
            page.drag(page.ask(HANDLE), 60)
            after = page.until(f"{ANSWER} != {before!r} && {ANSWER}")
            assert after != before
            page.until(f"{FIND}.filter((one) => one.tagName == 'CANVAS').length >= 4")
            second = page.picture()
            (tmp_path / f"{width}.png").write_bytes(second)
            assert second != first
            assert not page.ask(CODE)
            page.ask(f"{FIND}.find((one) => one.classList.contains('card-header')).click()")
            page.until(CODE)
    finally:
        server.stop()
