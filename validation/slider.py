"""Published observations on pushed sliders, beside the path of equilibria.

A slider of acrylic, 140 by 75 mm, is pressed by 1 MPa onto a base of 300 by 30 mm. Friction
coefficients scatter around 0.7 and fall to 0.45. Rows are means over five surfaces. The
observations were read in the abstracts of the papers only.

Run: ``python validation/slider.py``
"""

import warnings

import numpy as np
import xarray as xr

import stiction as st

LENGTH, NODES, SURFACES = 0.14, 280, 5
WEAKENING_RATE = 0.4e12  # Pa/m, for a nucleation length of 4.3 mm
HEIGHTS = (0.006, 0.012, 0.02, 0.04, 0.06)  # of the push, m
SHARES = (0.3, 0.35, 0.4, 0.42)  # push over normal force


def rig(height=0.006, residual=0.45, peak=0.7, **slider):
    """Return a problem, and friction coefficients (surfaces, nodes) with a mean `peak`."""
    parts = {
        "height": 0.075,
        "base": st.Base(height=0.03, behind=0.06, ahead=0.1),
        "drive": st.Pusher(height=height, width=0.004),
    }
    problem = st.Problem(
        solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        interface=st.Interface(length=LENGTH, nodes=NODES),
        friction=st.LinearWeakening(weakening_rate=WEAKENING_RATE),
        load=st.Load(normal_pressure=1e6),
        specimen=st.Slider(**(parts | slider)),
    )
    field = st.RandomField(
        st.Beta(alpha=3.0, beta=3.0, low=0.58, high=0.82),
        st.PowerLawSpectrum(correlation_length=0.004),
        quantity="friction_coefficient",
    )
    rough = field.sample(problem.interface, seed=1, samples=SURFACES) - 0.7
    dims = ("sample", "x")
    x = {"x": problem.interface.x}
    profiles = {
        "strength": xr.DataArray(peak + rough, x, dims, attrs={"units": "1"}),
        "residual_strength": xr.DataArray(residual, attrs={"units": "1"}),
    }
    return problem, profiles


def lengths(problem, profiles):
    """Return the slipped part of the interface at `SHARES`, as a mean over the surfaces."""
    part = np.zeros((SURFACES, len(SHARES)))
    for row in range(SURFACES):
        surface = {"strength": profiles["strength"][row], **{
            name: values for name, values in profiles.items() if name != "strength"
        }}  # fmt: skip
        path = st.equilibrium_path(problem, surface, 1e6 * np.array(SHARES))
        # The front is the end of the slip that begins at the trailing end. After sliding all slips.
        slips = np.where(path.sliding.values[:, None], 1.0, path.slip.values) > 0.0
        part[row] = [np.argmin(np.append(at_load, False)) / NODES for at_load in slips]
    return part.mean(axis=0)


def show(label, numbers):
    """Print a row."""
    print(f"  {label:34s}", *(f"{number:8.3f}" for number in numbers))


def main():
    """Print lengths of precursors, places of nucleation, and local friction."""
    warnings.simplefilter("ignore")
    print("length of slip over L at push over normal force", *SHARES)
    for height in HEIGHTS:  # Katano and others, 2014
        show(f"push at {1e3 * height:g} mm", lengths(*rig(height)))
    for residual in (0.35, 0.45, 0.55):  # Kammer and others, 2015
        show(f"residual coefficient {residual:g}", lengths(*rig(residual=residual)))
    for peak in (0.65, 0.7, 0.8):
        show(f"peak coefficient {peak:g}", lengths(*rig(peak=peak)))
    print("place of the first instability over L, first instability, static friction")
    cases = {f"push at {1e3 * height:g} mm": {"height": height} for height in HEIGHTS}
    cases |= {f"push at 6 mm, tilt {tilt:g}": {"tilt": tilt} for tilt in (-0.8, 0.8)}
    top = st.TopShear()
    cases |= {
        f"shear of the top, tilt {tilt:g}": {"drive": top, "tilt": tilt} for tilt in (-0.5, 0.5)
    }
    cases |= {"plate, push at 60 mm": {"height": 0.06, "pressing": "plate"}}
    for label, parts in cases.items():  # Scheibert and Dysthe, 2010
        problem, profiles = rig(**parts)
        found = st.onset(problem, profiles, method=st.Equilibrium(), progress=False)
        where = found.critical_position.values / LENGTH
        first = found.first_instability.values / 1e6
        show(label, [where.mean(), first.mean(), found.friction_coefficient.values.mean()])
    print("largest shear over pressure just before the first instability, static friction")
    for height in HEIGHTS:  # Ben-David, Cohen and Fineberg, 2010
        problem, profiles = rig(height)
        found = st.onset(problem, profiles, method=st.Equilibrium(), progress=False)
        surface = profiles | {"strength": profiles["strength"][0]}
        load = [(1.0 - 1e-9) * float(found.first_instability[0])]
        path = st.equilibrium_path(problem, surface, load)
        ratio = path.stress.values[0] / path.pressure.values[0]
        pressed = path.pressure.values[0] > 0.05e6
        show(
            f"push at {1e3 * height:g} mm",
            [ratio[pressed].max(), found.friction_coefficient[0]],
        )


if __name__ == "__main__":
    main()
