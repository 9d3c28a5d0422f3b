"""What counts as an instability of a rupture, and what is known where there was none."""

import warnings

import numpy as np
import pytest
from recording import stored
from ruptures import BREAKING_PLANE, CROOKED, CROOKED_STRENGTH, dip
from setups import QUARTER as SOLID
from setups import beta_strength, ensemble, exact_onset, make_problem, turns, within

import stiction as st

X = CROOKED.interface.x
OF_ONSET = stored("cases")["variables of an onset"]
SURVIVED = "load: an interface did not .* counts the interface as a survivor"


@pytest.fixture(scope="module")
def exact():
    return exact_onset(CROOKED, CROOKED_STRENGTH)


def held(top, loading_rate=2e7, back=1.0, **options):
    """A load that rises to `top`, holds, and then goes to a share of it."""
    end = top / loading_rate
    values = [0.0, top, top, back * top, back * top]
    return st.Rupture(
        load_history=(end * np.array([0.0, 1.0, 1.5, 2.0, 3.0]), values), **options
    )


def simulate(method, strength=CROOKED_STRENGTH, problem=CROOKED, **save):
    return st.simulate_rupture(
        problem, strength, method=method, save=st.Save(**save), progress=False
    )


@pytest.mark.parametrize(
    ("share", "back", "stop"),
    [(0.9, 1.0, "time"), (0.985, 1.0, "rest"), (0.985, 1.0, "onset"), (0.999, 0.3, "sliding")],
)
def test_below_the_onset_nothing_is_unstable(exact, share, back, stop):
    """The first slip is at 0.973 of the onset."""
    load = share * exact.critical_load.item()
    method = held(load, back=back, stop=stop, end_time=1.0 if stop == "time" else None)
    with pytest.warns(st.AccuracyWarning, match=SURVIVED) as caught:
        found = st.onset(CROOKED, CROOKED_STRENGTH, method=method)
    assert len(caught) == 1
    for name in OF_ONSET:
        assert np.isnan(found[name].item()), name
    if stop != "onset":
        assert found.arrested_events.item() == 0
        assert (found.seismic_moment.item() > 0.0) == (share > 0.973)


@pytest.mark.parametrize("loading_rate", [2e5, 2e7])
def test_above_it_the_onset_is_that_of_equilibrium_however_the_load_goes_on(
    exact, loading_rate
):
    """At 2e7 Pa/s inertia lifts it by some 1e-4."""
    top, close = 1.003 * exact.critical_load.item(), 1e-5 if loading_rate < 1e6 else 3e-4
    straight = st.onset(CROOKED, CROOKED_STRENGTH, method=st.Rupture(loading_rate=loading_rate))
    for back in (1.0, 0.3):
        with warnings.catch_warnings(action="error"):
            method = held(top, loading_rate, back, end_time=3.0 * top / loading_rate)
            found = st.onset(CROOKED, CROOKED_STRENGTH, method=method)
        for name in ("critical_stress", "first_instability"):
            assert found[name].item() == pytest.approx(exact[name].item(), rel=close)
            assert found[name].item() == pytest.approx(straight[name].item(), rel=2e-5)
        assert found.onset_time.item() == pytest.approx(straight.onset_time.item(), rel=2e-5)
        assert found.critical_position.item() == straight.critical_position.item()


def test_what_the_load_does_before_the_first_slip_does_not_matter():
    """But where it pushes back beyond the strength a warning says so."""
    straight = simulate(st.Rupture(loading_rate=1e8))
    times = np.array([0.0, 3e-3, 5e-3, 2e-2])
    for lowest, text in ((-2e5, None), (-9e5, "reverse")):
        load = (times, [0.0, 6e5, lowest, lowest + 1.5e6])
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = simulate(st.Rupture(load_history=load))
        assert [text in str(one.message) for one in caught] == [True] * (text is not None)
        assert found.critical_stress.item() == pytest.approx(
            straight.critical_stress.item(), rel=1e-5
        )


def test_an_arrested_instability_is_no_sliding():
    """Held above the first one, the interface survives whatever stress it carried."""
    weak = np.abs(X / 0.05 - 0.37) < 0.15
    strength = np.where(weak, CROOKED_STRENGTH - 5e5, CROOKED_STRENGTH + 1e6)
    first = exact_onset(CROOKED, strength)
    assert first.arrested_events.item() >= 1
    top = 0.5 * (first.first_instability.item() + first.critical_stress.item())
    method = held((top - CROOKED.load.initial_stress.mean()) / 1.2, 1e7)
    with pytest.warns(st.AccuracyWarning, match="did not slide before its run ended"):
        found = st.onset(CROOKED, strength, method=method)
    assert found.first_instability.item() == pytest.approx(
        first.first_instability.item(), rel=5e-4
    )
    assert weak[round(found.critical_position.item() / CROOKED.interface.spacing)]
    assert found.arrested_events.item() >= 1
    for name in ("critical_stress", "critical_load", "kinetic_stress", "stress_drop"):
        assert np.isnan(found[name].item()), name


def test_nodes_that_creep_beside_a_barrier_do_not_raise_the_onset():
    """The last of them breaks at a stress that grows with the number of nodes, without end."""
    rng = np.random.default_rng(2)
    waves = [(k, *rng.standard_normal(2)) for k in range(1, 11)]
    onsets = []
    for nodes in (128, 256):
        angle = turns(nodes)
        strength = 1e6 + 1.2e5 * sum(
            a * np.cos(k * angle) + b * np.sin(k * angle) for k, a, b in waves
        )
        problem = make_problem(
            nodes, 0.1, solid=SOLID, weakening_rate=1.4e11, residual_strength=3e5, mode="III"
        )
        barrier = (np.arange(nodes) * 128 >= 80 * nodes) & (
            np.arange(nodes) * 128 < 110 * nodes
        )
        problem = within(problem, ~barrier)
        run = simulate(st.Rupture(loading_rate=2e7), strength, problem)
        assert run.arrested_events.item() > 0
        assert run.critical_load.item() < 0.97 * run.step_load.values[-1]
        onsets.append((run.critical_stress.item(), run.critical_load.item()))
    assert onsets[1] == pytest.approx(onsets[0], rel=2e-3)  # 8e-4: of second order in the grid


def test_an_interface_that_slid_is_at_rest_once_it_is_unloaded(exact):
    top = 1.003 * exact.critical_load.item()
    times = top / 2e7 + np.array([-top / 2e7, 0.0, 1e-4, 2e-4])
    run = simulate(st.Rupture(load_history=(times, [0.0, top, 0.0, 0.0]), stop="rest"))
    assert run.attrs["stopped"] == "rest"
    assert run.critical_stress.item() == pytest.approx(exact.critical_stress.item(), rel=3e-4)
    assert run.weakened_fraction.values[-1] == 1.0
    assert run.top_slip_rate.values[-1] == 0.0


def test_a_narrow_barrier_under_a_fast_load_does_not_keep_a_run_from_its_end():
    """Slip that the load alone drives never rests there: it is steady instead."""
    problem = within(CROOKED, np.abs(X / 0.05 - 0.7) >= 0.01)
    run = simulate(st.Rupture(loading_rate=3e9, max_steps=20_000), problem=problem)
    assert run.attrs["stopped"] == "rest"
    assert run.critical_stress.item() > 0.0


def test_an_ensemble_counts_what_survived():
    """Held at a load between those of many onsets; the weakest nodes of some do not even slip."""
    problem = make_problem(
        128, 0.1, solid=SOLID, weakening_rate=1.2e11, residual_strength=2e5,
        load=st.Load(profile=1.0 + 0.3 * dip(st.Interface(0.1, 128), 0.03, 0.02)),
    )  # fmt: skip
    field = beta_strength(1.5e-2, mean_mode=True)
    exact = ensemble(problem, field, 50, method=st.Equilibrium())
    top = float(np.sort(exact.critical_load)[28:30].mean())
    method = held(top)
    with pytest.warns(st.AccuracyWarning, match=SURVIVED):
        found = ensemble(problem, field, 50, method=method)
    failed = exact.critical_load.values <= top
    assert np.array_equal(np.isfinite(found.critical_stress), failed)
    first_slip = (field.sample(problem.interface, samples=50) / problem.load.profile).min(
        axis=1
    )
    assert 0 < np.sum(first_slip > top) < np.sum(~failed)


def test_a_fault_becomes_unstable_where_and_when_its_patch_breaks():
    """In an unbreakable plane; not when slip dies and the mean stress returns."""
    plane = BREAKING_PLANE.interface
    x, y = np.meshgrid(*plane.coordinates.values(), indexing="ij")
    inside = (np.abs(x - 0.017) < 0.014) & (np.abs(y - 0.016) < 0.009)
    patch = (np.abs(x - 0.012) < 0.0045) & (np.abs(y - 0.013) < 0.004)
    field = beta_strength(0.004, 1e6, 1.1e6, mean_mode=True)
    strength = field.sample(plane, samples=1, seed=0)[0]
    initial = np.where(patch, 1.005 * strength, 7e5)
    problem = make_problem(
        plane.shape, plane.lengths, solid=SOLID, critical_slip=2e-6, residual_strength=4e5,
        load=st.Load(initial_stress=initial),
    )  # fmt: skip
    method = st.Rupture(load_history=([0.0, 1.0], [0.0, 0.0]), stop="time", end_time=3e-4)
    with warnings.catch_warnings(action="ignore"):
        run = simulate(method, strength, within(problem, inside), every=4)
    late = run.top_slip_rate[-1].item() / run.top_slip_rate.max().item()
    assert late < 1e-3
    whole = run.shear_stress.values.mean(axis=(1, 2))
    assert whole[-1] > whole[0]
    assert np.isfinite(run.arrival_time.values[inside]).mean() > 0.9
    assert run.onset_time.item() == run.applied_load.item() == 0.0
    assert run.first_instability.item() == initial[inside].mean()
    node = np.round(run.critical_position / BREAKING_PLANE.interface.spacings).astype(int)
    assert patch[tuple(node.values)]
    # Where it meets what is unbreakable, slip is short.
    for name in ("critical_load", "critical_stress", "kinetic_stress"):
        assert np.isnan(run[name].item())
