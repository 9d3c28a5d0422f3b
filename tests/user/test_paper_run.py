"""The whole paper in its shortest form: every file there, nothing blank, mistakes refused."""

import csv
import re
import shutil
import time
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.papers.albertini2020.claims import CLAIMS
from stiction.papers.albertini2020.figures import FIGURES
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies import STUDIES


def _options() -> dict:
    return {
        "samples": 64,
        "ruptures": 16,
        "full": True,
        "setting": Setting(problem=st.paper.problem(nodes=256)),
    }


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("paper") / "new" / "folder"
    steps = []
    report = st.paper.run(
        out, progress=lambda done, total: steps.append((done, total)), **_options()
    )
    assert report == out / "report.html"
    assert steps[-1][0] == steps[-1][1]
    assert steps == sorted(steps)
    return out


def test_every_figure_is_there_and_not_blank(folder):
    for figure in FIGURES.values():
        path = folder / "figures" / f"figure-{figure.number}-{figure.name}.png"
        pixels = matplotlib.image.imread(path)[..., :3]
        assert pixels.shape[1] > 1000
        # Ink on at least 1 % of the area, and not on all of it.
        assert 0.01 < np.mean(pixels.min(axis=2) < 0.6) < 0.7
        assert path.with_suffix(".pdf").read_bytes().startswith(b"%PDF")


def test_figures_are_legible_in_grey(folder):
    """No series may be so light that grey print loses it."""
    from matplotlib.colors import to_rgb

    from stiction.plot.style import color, series

    styles = [series(i, marker=True) for i in range(4)]
    assert len({str(style["linestyle"]) for style in styles}) == 4
    assert len({style["marker"] for style in styles}) == 4
    light = [float(np.dot(to_rgb(color(i)), (0.299, 0.587, 0.114))) for i in range(4)]
    assert light == sorted(light)
    assert max(light) < 0.72


def test_report_holds_all_it_shows(folder):
    html = (folder / "report.html").read_text(encoding="utf-8")
    assert html.count("data:image/png;base64,") == len(FIGURES)
    # Nothing is fetched from elsewhere.
    assert not re.search(r"""(src|href)=["'](https?:|//|file:)""", html)
    assert "<link" not in html
    assert html.count('class="verdict"') == len(CLAIMS)
    for text in ("Provenance", "numpy", "seed 0", "Time taken", "Does not hold"[5:]):
        assert text in html
    # No symbol is left as it is written in the sources.
    body = re.sub(
        r"base64,[^\"]*|<code>.*?</code>|<style>.*?</style>|<script>.*?</script>",
        "",
        html,
        flags=re.S,
    )
    assert not re.search(r"\b(tau|xi|h)_[a-z0-9]+\b", body)


def test_tables_and_results_are_whole(folder):
    with (folder / "tables" / "claims.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {row["claim"] for row in rows} == set(CLAIMS)
    assert all(row["verdict"] and row["computed"] for row in rows)
    assert len(list((folder / "tables").glob("figure-*.csv"))) >= len(FIGURES)
    root = xr.open_dataset(folder / "results.nc")
    assert root.attrs["samples"] == 64
    assert root.attrs["stiction_version"] == st.__version__
    root.close()
    for name in STUDIES:
        with xr.open_dataset(folder / "results.nc", group=name) as study:
            assert study.attrs["title"]
    assert not list(folder.rglob("*.part"))


def test_same_numbers_whatever_the_workers(folder, tmp_path):
    st.paper.run(tmp_path, workers=1, only=["mc"], **_options())
    with (
        xr.open_dataset(folder / "results.nc", group="monte_carlo") as one,
        xr.open_dataset(tmp_path / "results.nc", group="monte_carlo") as other,
    ):
        for name in ("critical_stress", "critical_position", "nucleation_counts"):
            np.testing.assert_array_equal(one[name].values, other[name].values)


def test_only_some_figures(tmp_path):
    report = st.paper.run(tmp_path, only="mapping", **_options())
    assert [path.name for path in (tmp_path / "figures").glob("*.png")] == ["figure-2-mapping.png"]
    html = report.read_text(encoding="utf-8")
    assert "Figure 5" not in html
    assert 'class="verdict"' not in html  # nothing was computed that could judge a claim
    # A second run replaces the first.
    st.paper.run(tmp_path, only=["problem", "variance"], **_options())
    html = report.read_text(encoding="utf-8")
    assert "Figure 7" in html
    assert html.count('class="verdict"') > 20
    assert "Theory against exact equilibrium" not in html
    shutil.rmtree(tmp_path)


def test_the_same_command_goes_on_where_it_was_interrupted(tmp_path, monkeypatch):
    """What is done is kept: nothing of it is computed again, and the results are the same."""
    from stiction.papers.albertini2020 import studies

    class Interrupted(BaseException):
        pass

    def interrupt(context):
        while len(list((tmp_path / "studies").glob("*.nc"))) < 2:
            time.sleep(0.05)
        raise Interrupted

    options = {**_options(), "full": False, "ruptures": 2, "only": ["problem", "growth"]}
    options["workers"] = 3
    with monkeypatch.context() as patch:
        patch.setattr(studies.STUDIES["growth"], "compute", interrupt)
        with pytest.raises(Interrupted):
            st.paper.run(tmp_path, **options)
    kept = {path.name.partition("-")[0] for path in (tmp_path / "studies").glob("*.nc")}
    assert kept == {"theory", "monte_carlo"}
    assert not (tmp_path / "report.html").exists()
    done = []
    for name in kept:
        monkeypatch.setattr(studies.STUDIES[name], "compute", lambda context: done.append(context))
    steps = []
    st.paper.run(tmp_path, progress=lambda *step: steps.append(step), **options)
    assert not done
    assert steps[-1][0] == steps[-1][1]
    # Another seed is another study.
    with pytest.raises(AttributeError):
        st.paper.run(tmp_path, **{**options, "seed": 1})
    assert done


def test_what_is_kept_but_damaged_is_computed_again(tmp_path):
    options = {**_options(), "full": False, "only": ["growth"]}
    st.paper.run(tmp_path, **options)
    (path,) = (tmp_path / "studies").glob("growth-*.nc")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    st.paper.run(tmp_path, **options)
    assert path.stat().st_size == len(whole)


@pytest.mark.slow
def test_more_dynamic_samples_cost_only_what_is_new(tmp_path):
    options = {**_options(), "only": ["fidelity"]}
    st.paper.run(tmp_path, **{**options, "ruptures": 16})
    with xr.open_dataset(tmp_path / "results.nc", group="dynamic") as study:
        few = study["critical_stress"].values.copy()
    steps = []
    st.paper.run(tmp_path, progress=lambda *step: steps.append(step), **{**options, "ruptures": 24})
    with xr.open_dataset(tmp_path / "results.nc", group="dynamic") as study:
        np.testing.assert_array_equal(study["critical_stress"].values[:, :16], few)
        assert study.sizes["sample"] == 24


def test_all_mistakes_at_once(tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    with pytest.raises(st.InputError) as caught:
        st.paper.run(file, samples=3, seed=-1, workers=0, only=["mcc", "variance"])
    text = str(caught.value)
    assert "did you mean 'mc'" in text
    for key in ("samples", "seed", "workers", "out"):
        assert f"{key}:" in text
    assert len(caught.value.problems) == 5
    for key, wrong in {
        "out": (None, 3, ""),
        "setting": (5, {"nodes": 3}),
        "only": (5, []),
        "seed": (2**80, True),
        "workers": (True,),
        "quick": ("no",),
        "full": (1,),
        "progress": ("yes",),
    }.items():
        for value in wrong:
            options = {"out": tmp_path / "new", key: value}
            with pytest.raises(st.InputError, match=f"^{key}: "):
                st.paper.run(**options)
    assert not (tmp_path / "new").exists()
    with pytest.raises(st.InputError, match="needs full"):
        st.paper.run(tmp_path, only="fidelity")
    with pytest.raises(st.InputError, match="ruptures"):
        st.paper.run(tmp_path, full=True, ruptures=2)
    if Path("/proc").exists():
        with pytest.raises(st.InputError, match="out: /proc/stiction cannot be made"):
            st.paper.run("/proc/stiction")
