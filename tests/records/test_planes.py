"""Recorded outputs: planes where nothing is symmetric."""

import dataclasses

import numpy as np
from crooked import PLANE, PLANE_STRENGTH, across_the_seam, uneven
from recording import Calls, compared, inside
from setups import beta_strength, make_problem, without

import stiction as st

calls = Calls()
INTERFACE = PLANE.interface
TWO = np.stack(
    [
        PLANE_STRENGTH,
        1.03 * np.roll(PLANE_STRENGTH, (5, 7), (0, 1)) - 3e4 * uneven(INTERFACE, seed=8),
    ]
)
GAP = 3e-6
"""Solved to bounds of 1e-6: derived numbers agree to the root of that or better."""
ORACLE = "linear programme and dense eigenvectors, tests/oracle/test_crooked.py"
EVENTS = "stepping with bounds, tests/oracle/test_plane_equilibrium.py"


def barred():
    """A weak place within a barrier, and another outside."""
    seam, wall = (across_the_seam(INTERFACE, r) > np.exp(-1.0) for r in (4.6e-3, 6.2e-3))
    dip = np.roll(across_the_seam(INTERFACE, 5e-3), (11, 9), (0, 1))
    strength = 1.3e6 + 1e5 * uneven(INTERFACE, seed=5) - 4.5e5 * dip
    return np.where(
        seam, 5e5 + 1e5 * uneven(INTERFACE, seed=6), np.where(wall, 3.5e6, strength)
    )


@calls(ORACLE, close=1e-4)
def exact_onsets_with_slip():
    method = st.Equilibrium(slip=True, tolerance=1e-9)
    return st.onset(PLANE, TWO, method=method)


@calls(EVENTS, close=1e-4)
def arrested_event():
    return st.onset(PLANE, barred(), method=st.Equilibrium(events=2))


@calls(EVENTS, close=1e-4)
def a_law_of_two_pieces():
    friction = st.PiecewiseWeakening(
        weakening_rate=0.28e12,
        residual_strength=PLANE.friction.residual_strength,
        slip=(0.35, 1.0),
        strength=(0.5, 0.0),
    )
    problem = dataclasses.replace(PLANE, friction=friction)
    return st.onset(problem, TWO[1], method=st.Equilibrium())


@calls("more than what weakens", close=1e-4)
def strength_that_hardly_weakens():
    near = dataclasses.replace(PLANE.friction, residual_strength=0.97 * PLANE_STRENGTH)
    method = st.Equilibrium(slip=True)
    held = np.where(uneven(INTERFACE, seed=9) > 0.8, 2e6, 1e5)
    profiles = {"strength": PLANE_STRENGTH, "residual_strength": held}
    return {
        "near": st.onset(
            dataclasses.replace(PLANE, friction=near), PLANE_STRENGTH, method=method
        ),
        "constant": st.onset(
            without(PLANE, "friction.residual_strength"), profiles, method=st.Equilibrium()
        ),
    }


@calls("states checked as equilibria, tests/oracle/test_plane_equilibrium.py", close=1e-4)
def a_path():
    return st.equilibrium_path(PLANE, TWO[0], [2e5, 4.3e5, 5.1e5, 2e6])


@calls("each sample as by onset", close=1e-5)
def an_ensemble_with_two_random_properties():
    residual = st.RandomField(
        st.Beta(alpha=2.0, beta=3.0, low=1e5, high=2.2e5), st.ExponentialSpectrum(4e-3)
    )
    random = st.RandomInterface(
        strength=beta_strength(3.3e-3, anisotropy=0.8),
        residual_strength=residual,
        correlation={("strength", "residual_strength"): 0.62},
    )
    friction = dataclasses.replace(PLANE.friction, residual_strength=0.0)
    problem = dataclasses.replace(PLANE, friction=friction)
    method = st.Equilibrium(tolerance=1e-8)
    return st.monte_carlo(problem, random, method=method, samples=3, seed=5, keep=("strength",))


@calls(
    "uguca, docs/evidence/accuracy.md; energy, tests/properties/test_dynamics_properties.py",
    close=1e-5,
)
def a_rupture_with_stations():
    problem = make_problem(
        (48, 40), (0.03, 0.0253), weakening_rate=0.13e12, residual_strength=2e5
    )
    strength = (
        1.0e6
        + 1.2e5 * uneven(problem.interface, seed=3)
        - 3e5 * np.roll(across_the_seam(problem.interface, 4e-3), (14, 9), (0, 1))
    )
    save = st.Save(
        ["slip", "slip_rate", "shear_stress"],
        every=40,
        stations={"a": (0.004, 0.021), "b": (0.02, 0.003)},
    )
    method = st.Rupture(loading_rate=6e8, kernel_tolerance=1e-5)
    found = st.simulate_rupture(problem, strength, method=method, save=save)
    with inside() as folder:
        options = {"origin": (0.012, 0.011), "normal_stress": -5e6, "benchmark": "TPV5"}
        files = st.external.write_scec(found, folder, **options)
        written = {path.name: path.read_text().split("\n") for path in files}
    return {"run": found} | {
        name: {
            "head": "\n".join(line for line in lines if line.startswith("# ")),
            "last": np.array([line.split() for line in lines[-40:-1]], dtype=float),
        }
        for name, lines in written.items()
    }


test_outputs_are_as_recorded = compared(calls, __file__)
