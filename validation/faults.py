"""Interfaces that end, beside a closed solution and published constants, and under fast loads.

    python validation/faults.py circle [NODES]    a circular rupture: Eshelby, Madariaga (10 s)
    python validation/faults.py loading [FAULTS]  events under faster and faster loads

**Circle.** R. Madariaga (Bull. Seism. Soc. Am. 66, 1976, 639) prescribes the speed of a circular
crack, 0.9 c_s, and stops it at a radius a. Here the rupture is spontaneous. It starts from a
weak disc, grows through a fracture energy that rises with the radius, so that its speed is
nearly constant, and arrests at the edge of the extent. Slip has the direction of the load, while in
Madariaga's model a little slip lies across. The static crack is J. D. Eshelby's (Proc. R. Soc. A
241, 1957, 376). The pulse in the far field in the direction g is the integral of V(x, t + g.x/c)
over the crack. Its corner frequency f_c is read in two ways, both exact for the spectrum
1/(1 + (f/f_c)²): where the velocity spectrum is largest, and from the ratio of the integrals of
velocity and displacement squared (D. J. Andrews, Earthquake Source Mechanics, AGU, 1986).
Madariaga reads f_c where two asymptotes meet. k = f_c a/c_s is a mean over the focal sphere.
The kinematic crack of T. Sato and T. Hirasawa (J. Phys. Earth 21, 1973, 415) shows what the
reading does. It grows at 0.9 c_s, always has Eshelby's shape and stops at once. They find f_c of P
waves 1.3 times as high as f_c of S waves on average.

**Loading.** How slow is slow? Heterogeneous faults of 2 km break under rates of the load from slow
to fast. r is the rise of the load while shear waves cross the nucleation length, as a share of the
stress scale.
"""

import sys
import warnings

import numpy as np

import stiction as st

RADIUS, SHEAR_SPEED, DROP, RESIDUAL = 1e3, 3464.0, 3e6, 15e6  # m, m/s, Pa, Pa
STRENGTH_RATIO = 0.6  # S = (tau_p - tau_0)/(tau_0 - tau_r)
START_SHARE = 0.25  # radius of the weak disc over a
DISC_NODES, DISC_SHARE = 3.6, 0.1  # G/W at least so many nodes and this share of the radius
BAND = np.linspace(0.0, 5.0, 251)  # frequencies, c_s/a; the shortest wave spans 8 nodes
HIGHEST_CORNER = 1.5  # c_s/a
DIRECTIONS = 200  # on the focal sphere
MADARIAGA = {"P": 0.32, "S": 0.21}
RATES = (3e3, 3e4, 1e5, 3e5, 1e6)  # Pa/s


def rock(shear_speed):
    """Return a Poisson solid of 2,700 kg/m³."""
    modulus = 2700.0 * shear_speed**2
    return st.Solid(shear_modulus=modulus, poisson_ratio=0.25, density=2700.0, plane="strain")


def circular_rupture(nodes):
    """Return a problem whose rupture arrests at a circle, its run, and places from the centre."""
    period, solid = 3.2 * RADIUS, rock(SHEAR_SPEED)
    circle = st.Ellipse(centre=(0.5 * period,) * 2, semi_axes=(RADIUS,) * 2)
    plane = st.Interface((period, period), (nodes, nodes), extent=circle)
    places = np.stack(np.meshgrid(*plane.coordinates.values(), indexing="ij")) - 0.5 * period
    radius = np.hypot(*places)
    critical = np.maximum(DISC_NODES * plane.spacing, DISC_SHARE * radius)
    law = st.LinearWeakening(
        weakening_rate=solid.shear_modulus / critical, residual_strength=RESIDUAL
    )
    start = radius < START_SHARE * RADIUS
    strength = RESIDUAL + DROP * np.where(start, 0.98, 1.0 + STRENGTH_RATIO)
    problem = st.Problem(solid, plane, law, st.Load(initial_stress=RESIDUAL + DROP))
    method = st.Rupture(load_history=([0.0, 1.0], [0.0, 0.0]), stop="rest", end_time=8.0)
    save = st.Save(["slip"], every=5)
    run = st.simulate_rupture(problem, strength, method=method, save=save, progress=False)
    return problem, run, places


def front_speeds(problem, run):
    """Return speeds of the front from 0.4 a to 0.9 a along x and y, over c_s."""
    nodes, spacing = problem.interface.shape[0], problem.interface.spacing
    near, far = (nodes // 2 + round(share * RADIUS / spacing) for share in (0.4, 0.9))
    arrival = run.arrival_time.values
    for along in (arrival[:, nodes // 2], arrival[nodes // 2]):
        yield (far - near) * spacing / (along[far] - along[near]) / SHEAR_SPEED


def corner_constants(time, slip, places, speed):
    """Return k = f_c a/c_s of waves with a speed, m/s, by both readings."""
    inside = np.hypot(*places) <= RADIUS
    omega = 2.0 * np.pi * BAND * SHEAR_SPEED / RADIUS
    middle, length = 0.5 * (time[1:] + time[:-1]), np.diff(time)
    waves = np.exp(-1j * np.outer(omega, middle)) * np.sinc(np.outer(omega, length) / 2 / np.pi)
    slip_rate = waves @ np.diff(slip[:, inside], axis=0)  # transforms of slip rates
    # Equal areas of the focal sphere, along a spiral.
    share = np.sqrt(1.0 - (1.0 - (2.0 * np.arange(DIRECTIONS) + 1.0) / DIRECTIONS) ** 2)
    angle = np.pi * (1.0 + 5.0**0.5) * np.arange(DIRECTIONS)
    corners = []
    for along in np.stack([share * np.cos(angle), share * np.sin(angle)], axis=1):
        delay = np.tensordot(along, places, 1)[inside] / speed
        pulse = np.abs((slip_rate * np.exp(1j * np.outer(omega, delay))).sum(axis=1))
        velocity, low = BAND * pulse, BAND < HIGHEST_CORNER
        by_integrals = np.sqrt((velocity**2).sum() / (pulse**2).sum())
        corners.append((BAND[np.argmax(velocity[low])], by_integrals))
    return np.mean(corners, axis=0)


def kinematic_slip(places):
    """Return times and slip of a crack that grows at 0.9 c_s and keeps Eshelby's shape."""
    speed = 0.9 * SHEAR_SPEED
    time = np.linspace(0.0, RADIUS / speed, 200)
    radius = speed * time[:, None, None]
    return time, np.sqrt(np.maximum(radius**2 - (places**2).sum(axis=0), 0.0))


def circle(nodes=128):
    """Print the circular rupture beside the static crack and published constants."""
    problem, run, places = circular_rupture(nodes)
    inside, slip = problem.interface.breakable, run.slip.values[-1]
    # Half a cell beyond the outermost nodes still belongs to the crack.
    radius = RADIUS + 0.5 * problem.interface.spacing
    shape = np.sqrt(np.maximum(1.0 - (places**2).sum(axis=0) / radius**2, 0.0))
    eshelby = 24.0 / (7.0 * np.pi) * DROP / problem.solid.shear_modulus * radius * shape
    overshoot = slip.sum() / eshelby.sum()
    apart = np.sqrt(np.mean((slip - overshoot * eshelby)[inside] ** 2)) / slip.max()
    print(f"{nodes} x {nodes} nodes, {radius / problem.interface.spacing:.0f} in the radius")
    along_x, along_y = front_speeds(problem, run)
    print(f"speed of the front over c_s: {along_x:.2f} along x, {along_y:.2f} along y")
    print(
        f"final slip over Eshelby's: mean {overshoot:.3f}, centre {slip.max() / eshelby.max():.3f}"
    )
    print(f"  distance from Eshelby's shape, rms over the largest slip: {apart:.3f}")
    print(
        f"static stress drop over the dynamic: {run.event_slip_stress_drop.item() / DROP:.3f}"
    )
    print("k = f_c a/c_s              largest velocity   integrals   Madariaga")
    waves = {"P": 3.0**0.5 * SHEAR_SPEED, "S": SHEAR_SPEED}
    cracks = {
        "dynamic": (run.time.values, run.slip.values),
        "kinematic": kinematic_slip(places),
    }
    for crack, course in cracks.items():
        for name, speed in waves.items():
            k = corner_constants(*course, places, speed)
            known = f"{MADARIAGA[name]:12.2f}" if crack == "dynamic" else ""
            print(f"  {crack:10s} {name}             {k[0]:14.2f}   {k[1]:9.2f}{known}")


def loading(faults=60):
    """Print events under faster and faster loads."""
    line = st.Interface(4e3, 1024, extent=(1e3, 3e3))
    law = st.LinearWeakening(critical_slip=0.018, residual_strength=25e6)
    problem = st.Problem(rock(3000.0), line, law, st.Load(initial_stress=22e6), mode="III")
    marginal = st.Beta(alpha=1.5, beta=2.0, low=25.2e6, high=36e6)
    strength = st.RandomField(marginal, st.PowerLawSpectrum(300.0), mean_mode=True)
    steepest = 11e6 / 0.018
    crossing = problem.nucleation_lengths(steepest)[0] / problem.solid.shear_wave_speed
    scale = strength.sample(line, samples=faults, seed=1).mean() - 25e6
    print(f"{2e3 / problem.nucleation_lengths(steepest)[0]:.0f} nucleation lengths")
    print(
        "rate (Pa/s)   r          arrested   moment of all events   critical load (of slow ones)"
    )
    slow = None
    for loading_rate in RATES:
        method = st.Rupture(loading_rate=loading_rate, events=40)
        found = st.monte_carlo(
            problem, strength, method=method, samples=faults, seed=1, progress=False
        )
        moment = float(found.event_moment.sum())
        load = found.critical_load.values
        slow = slow or (moment, load)
        print(
            f"{loading_rate:8.0e}   {loading_rate * crossing / scale:8.1e}"
            f"   {int(found.arrested_events.sum()):6d}"
            f"   {moment / slow[0]:12.3f}   {np.mean(load / slow[1]):20.4f}",
            flush=True,
        )


if __name__ == "__main__":
    warnings.simplefilter("ignore", st.AccuracyWarning)
    {"circle": circle, "loading": loading}[sys.argv[1]](*map(int, sys.argv[2:]))
