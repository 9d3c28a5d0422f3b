"""Trends of the literature: friction depends on how specimens are driven, pressed and cut.

The local strength is a friction coefficient times the pressure; the critical slip belongs to the
surface, so that the weakening rate is proportional to the pressure.

Run: ``python validation/trends.py [PRESSURE]``, 2.5e6 Pa if not given
"""

import sys
import warnings

import numpy as np

import stiction as st

MACHINE = 2e7  # N/m
FIELD = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.132, high=0.332),
    st.PowerLawSpectrum(correlation_length=1.75e-3),
    quantity="friction_coefficient",
)
PUSHERS = (0.025, 0.015, 0.01, 0.005)  # heights, m


def rig(drive, pressure, length=0.1, pressing="frictionless"):
    """Two acrylic blocks, 50 mm high and 6 mm thick, nodes 0.39 mm apart."""
    return st.Problem(
        solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        interface=st.Interface(length=length, nodes=round(length * 2560)),
        friction=st.LinearWeakening(critical_slip=1e-6, residual_ratio=0.5),
        specimen=st.Blocks(height=0.05, thickness=0.006, drive=drive, pressing=pressing),
        load=st.Load(normal_pressure=pressure),
    )


def pusher(height):
    """A pusher 4 mm wide."""
    return st.Pusher(height=height, width=0.004, stiffness=MACHINE)


def cases(usual):
    """All rigs by name, under the usual pressure (Pa) where it is not swept."""
    platen = st.Platen(stiffness=MACHINE)
    yield "platen", rig(platen, usual)
    yield "platen, glued", rig(platen, usual, pressing="glued")
    for height in PUSHERS:
        yield f"pusher at {1e3 * height:g} mm", rig(pusher(height), usual)
    for pressure in (0.625e6, 1.25e6, 2.5e6, 5e6):
        for name, drive in (("platen", platen), ("pusher at 10 mm", pusher(0.01))):
            yield f"{name}, {1e-6 * pressure:g} MPa", rig(drive, pressure)
    for length in (0.025, 0.05, 0.1, 0.2):
        for name, drive in (("platen", platen), ("pusher at 10 mm", pusher(0.01))):
            yield f"{name}, {1e3 * length:g} mm long", rig(drive, usual, length)


def main(pressure=2.5e6, samples=24):
    """Print means, with standard errors, of coefficients and events of the same surfaces."""
    warnings.simplefilter("ignore")
    for name, problem in cases(pressure):
        found = st.monte_carlo(
            problem,
            FIELD,
            method=st.Equilibrium(events=200),
            samples=samples,
            seed=0,
            pilot=False,
        )
        mu, share = found.friction_coefficient, found.event_length / problem.interface.measure
        error = float(mu.std()) / np.sqrt(samples - 1)
        print(
            f"{name:28s} coefficient {float(mu.mean()):.4f} +- {error:.4f};"
            f" {float(found.arrested_events.mean()):5.1f} events, the first"
            f" {float(share.isel(event=0).mean()):.3f} and all"
            f" {float(share.mean()):.3f} of the length; first instability"
            f" {float((found.first_instability / found.critical_stress).mean()):.3f} of the peak",
            flush=True,
        )


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
