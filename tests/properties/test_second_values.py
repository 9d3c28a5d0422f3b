"""Every option counts: its second value does something, and what must not matter does not.

The default of an option is tried wherever a function is tested. The faults that tests missed sat in
the other branch: sample 1 instead of 0, seed 2 instead of 1, one row that is repeated, a position
that is shifted. Each test here states a rule that holds for every call of a kind.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from crooked import LINE, PLANE, PLANE_STRENGTH, TWO
from setups import EXACT, LOCAL, beta_strength, make_problem
from small_study import small_study
from specimens import crooked, rough

import stiction as st

FIELD = beta_strength(4e-3)
PROBLEM = make_problem(weakening_rate=0.25e12)
JOINT = crooked(nodes=64, drive=st.Pusher(height=0.008, width=0.004))
JOINT_STRENGTH = rough(JOINT, 1, samples=2)
PLANES = np.stack([PLANE_STRENGTH, 1.03 * np.roll(PLANE_STRENGTH, (5, 3), (0, 1))])


def drawn(panels: Any) -> list[Any]:
    """All that the figure of these axes draws: points of lines, patches, maps, marks and texts."""
    figure = np.ravel(panels)[0].figure
    parts: list[Any] = []
    for axes in figure.axes:
        parts += [np.asarray(line.get_xydata(), dtype=float) for line in axes.lines]
        parts += [patch.get_path().vertices for patch in axes.patches]
        parts += [np.asarray(patch.get_extents().get_points()) for patch in axes.patches]
        parts += [np.ma.filled(image.get_array(), np.nan) for image in axes.images]
        parts += [np.ma.filled(mesh.get_array(), np.nan) for mesh in axes.collections
                  if mesh.get_array() is not None]  # fmt: skip
        texts = [line.get_label() for line in axes.lines]
        parts += [np.array(texts + [text.get_text() for text in axes.texts])]
    plt.close(figure)
    return parts


def same(drawing: list[Any], reference: list[Any]) -> bool:
    return len(drawing) == len(reference) and all(
        np.array_equal(part, expected) or
        (part.dtype.kind == "f" and np.allclose(part, expected, rtol=1e-12, equal_nan=True))
        for part, expected in zip(drawing, reference, strict=True)
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["line", "plane", "specimen"])
def test_a_plot_of_sample_1_is_the_plot_of_its_row_alone(kind):
    problem, strength, draw = {
        "line": (LINE, TWO, lambda result, *more, **options: st.plot.onset(
            result, *more, problem=LINE, **options)),
        "plane": (PLANE, PLANES, lambda result, *more, **options: st.plot.onset(
            result, *more, problem=PLANE, **options)),
        "specimen": (JOINT, JOINT_STRENGTH, lambda result, rows, **options: st.plot.specimen(
            JOINT, rows, result, **options)),
    }[kind]  # fmt: skip
    both = st.onset(problem, strength, method=LOCAL)
    alone = st.onset(problem, strength[1:], method=LOCAL)
    second, first = drawn(draw(both, strength, sample=1)), drawn(draw(both, strength))
    assert same(second, drawn(draw(alone, strength[1:])))
    assert not same(second, first)


def test_a_plot_reads_units_and_directions_like_a_call():
    """A profile in MPa was drawn as one in Pa, and a map over (y, x) with its axes swapped."""
    onset = st.onset(LINE, TWO, method=LOCAL)
    labelled = xr.DataArray(TWO * 1e-6, dims=("sample", "x"), attrs={"units": "MPa"})
    pairs = [
        [drawn(st.plot.onset(onset, rows, problem=LINE)) for rows in (labelled, TWO)],
        [drawn(st.plot.field(LINE, rows)) for rows in (labelled, TWO)],
        [
            drawn(st.plot.field(PLANE, rows))
            for rows in (xr.DataArray(PLANE_STRENGTH.T, dims=("y", "x")), PLANE_STRENGTH)
        ],
    ]
    for drawing, reference in pairs:
        assert same(drawing, reference)


def test_a_plot_refuses_what_it_cannot_draw():
    for name in {*st.plot.__all__} - {"field", "film", "onset"}:
        for wrong in (3, "result", None, [3]):
            with pytest.raises(st.InputError):
                getattr(st.plot, name)(wrong)
    assert not plt.get_fignums()


def test_events_are_not_drawn_if_none_came_to_rest():
    """Logarithmic scales without a number failed when the figure was saved."""
    names = ("event_moment", "event_length", "event_area_stress_drop")
    empty = ("sample", "event"), np.full((2, 3), np.nan), {"units": "N"}
    with pytest.raises(st.InputError, match="has no events"):
        st.plot.events(xr.Dataset(dict.fromkeys(names, empty)), problem=PROBLEM)


def test_a_sample_that_does_not_exist_is_refused():
    onset = st.onset(JOINT, JOINT_STRENGTH, method=LOCAL)
    for sample in (2, -1, 0.5, "a"):
        with pytest.raises(st.InputError, match="sample: "):
            st.plot.specimen(JOINT, JOINT_STRENGTH, onset, sample=sample)
        with pytest.raises(st.InputError, match="sample: "):
            st.plot.onset(onset, JOINT_STRENGTH, problem=JOINT, sample=sample)
    with pytest.raises(st.InputError, match="sample: 1 of results and strength with 1, 2"):
        st.plot.specimen(JOINT, JOINT_STRENGTH[:1], onset, sample=1)
    run = xr.Dataset({"slip_rate": (("time", "x"), np.ones((3, 96)))})
    with pytest.raises(st.InputError, match=r"problem: has \(64,\) nodes, the result \(96,\)"):
        st.plot.rupture(run.assign(onset_time=0.0, critical_position=0.0), problem=JOINT)
    assert not plt.get_fignums()


SWEPT = {
    name: xr.Dataset(
        {"critical_stress": (("length", "sample"), values, {"units": "Pa"})},
        {"length": ("length", [0.1, 0.2, 0.4], {"units": "m"})},
    )
    for name, values in (
        ("a", 7e5 + 1e4 * np.sin(np.arange(90.0)).reshape(3, 30)),
        ("b", 8e5 + 2e4 * np.cos(np.arange(90.0)).reshape(3, 30)),
    )
}
TOGETHER = {name: result.isel(length=0) for name, result in SWEPT.items()}


def test_figures_are_of_pyplot_once_and_on_the_axes_that_are_given():
    onset = st.onset(LINE, TWO, method=LOCAL)
    for call in (
        lambda ax: st.plot.onset(onset, TWO, problem=LINE, ax=ax),
        lambda ax: st.plot.monte_carlo(TOGETHER, ax=ax),
        lambda ax: st.plot.quantiles(SWEPT, ax=ax),
        lambda ax: st.plot.field(LINE, TWO[1], ax=ax),
    ):
        plt.close("all")
        number = call(None).figure.number
        assert plt.get_fignums() == [number]
        _, given = plt.subplots()
        assert call(given) is given
        assert [*given.lines, *given.texts]
    plt.close("all")
    assert st.plot.specimen(JOINT).shape == (2,)
    assert len(plt.get_fignums()) == 1


def test_results_by_name_are_compared_along_one_sweep():
    axes = st.plot.quantiles(SWEPT)
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["a", "b"]
    plt.close(axes.figure)
    shifted = SWEPT | {"c": SWEPT["b"].assign_coords(length=[0.1, 0.2, 0.5])}
    with pytest.raises(st.InputError, match="same sweep.*'c'"):
        st.plot.quantiles(shifted)


def test_a_shift_of_everything_shifts_the_position_also_after_arrests():
    """Two dips between strong parts: the first instability is arrested at its residual strength."""
    problem = make_problem(weakening_rate=0.5e12, residual_strength=0.8e6)
    x = problem.interface.x
    dips = 0.45 * np.exp(-(((x - 0.03) / 3e-3) ** 2)) + 0.40 * np.exp(
        -(((x - 0.07) / 9e-3) ** 2)
    )
    strength = 1e6 * (1.5 - dips)
    nodes = 37
    results = st.onset(problem, np.stack([strength, np.roll(strength, nodes)]), method=EXACT)
    assert (results.arrested_events > 0).all(), "the case no longer has an arrested event"
    shift = np.diff(results.critical_position.values)[0] % problem.interface.length
    assert shift == pytest.approx(nodes * problem.interface.spacing, abs=1e-9)
    # A shift changes the order of sums only.
    assert results.critical_stress[1] == pytest.approx(
        float(results.critical_stress[0]), rel=1e-9
    )


def test_a_path_is_in_pascals_and_metres_whatever_the_scale():
    """A thousand times the stresses and moduli give the same slip at a thousand times the load."""
    factor = 1e3
    stiffer = dataclasses.replace(
        PROBLEM,
        solid=dataclasses.replace(PROBLEM.solid, shear_modulus=factor * 1e9),
        friction=st.LinearWeakening(weakening_rate=factor * 0.25e12),
    )
    strength = FIELD.sample(PROBLEM.interface, seed=3)[0]
    loads = np.array([0.5, 0.7, 0.75]) * 1e6
    path = st.equilibrium_path(PROBLEM, strength, loads)
    scaled = st.equilibrium_path(stiffer, factor * strength, factor * loads)
    assert path.slip.attrs["units"] == "m"
    assert {path[name].attrs["units"] for name in ("stress", "mean_stress", "load")} == {"Pa"}
    # Both solve the same equations but for one factor, which is no power of two.
    np.testing.assert_allclose(scaled.slip, path.slip, rtol=1e-9, atol=1e-18)
    np.testing.assert_allclose(scaled.mean_stress, factor * path.mean_stress, rtol=1e-9)


def test_a_study_of_a_plane_holds_its_profiles_as_arrays():
    plain = small_study((24, 20), (0.023, 0.0164), weakening_rate=0.28e12)
    problem = st.Study.from_dict(plain).problem
    shape = 1.0 + 0.1 * np.add.outer(np.arange(24.0), 3.0 * np.arange(20.0)) / 80.0
    loaded = dataclasses.replace(problem, load=st.Load(profile=shape))
    study = dataclasses.replace(st.Study.from_dict(plain), problem=loaded)
    again = st.Study.from_dict(study.to_dict()).problem.sample(PLANE_STRENGTH)
    expected = loaded.sample(PLANE_STRENGTH)
    np.testing.assert_array_equal(again.load_profile, expected.load_profile)


def test_a_failure_curve_is_drawn_in_the_unit_of_its_label():
    curve = st.failure_curve(
        PROBLEM, FIELD, method=LOCAL, smallest=1e-2, target_cv=0.3, progress=False
    )
    axes = st.plot.failure_curve(curve)
    assert "(MPa)" in axes.get_xlabel()
    (line,) = [line for line in axes.lines if len(line.get_xdata()) == curve.sizes["point"]]
    np.testing.assert_allclose(line.get_xdata(), 1e-6 * curve.stress, rtol=1e-12)
    np.testing.assert_allclose(line.get_ydata(), curve.probability, rtol=1e-12)
    plt.close(axes.figure)
