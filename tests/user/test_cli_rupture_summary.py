"""What the command prints of a rupture, and films where there is no ffmpeg."""

import matplotlib
import numpy as np
import pytest
import xarray as xr
from stiction.cli.rupture import _summary

import stiction as st
from stiction import InputError
from stiction.plot import films

PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress"),
    st.Interface(length=0.05, nodes=128),
    st.LinearWeakening(weakening_rate=0.2e12),
)


def result(**values):
    scalars = {
        "critical_stress": 7e5, "kinetic_stress": -1e-9, "stress_drop": 7e5,
        "critical_position": 0.01, "onset_time": 0.07, "median_rupture_speed": 1500.0,
        "rupture_speed": 4000.0,
    } | values  # fmt: skip
    dataset = xr.Dataset({name: ((), value) for name, value in scalars.items()})
    dataset["radiated_energy"] = ("time", [0.0, 3.25], {"units": "J/m"})
    return dataset.assign_attrs(stopped="sliding")


def test_the_median_speed_leads_and_speeds_above_c_d_are_called_apparent():
    text = _summary(result(), PROBLEM)
    assert "stress drop 0.700000 MPa" in text
    assert "kinetic stress 0.000000 MPa" in text
    assert "radiated energy 3.25 J/m" in text
    assert text.index("front speed 1500 m/s (median") < text.index("4000 m/s: above c_d")
    assert "apparent" in text
    assert "above c_d" not in _summary(result(rupture_speed=1550.0), PROBLEM)


def test_what_is_not_known_is_not_printed():
    unknown = dict.fromkeys(("kinetic_stress", "stress_drop", "median_rupture_speed"), np.nan)
    text = _summary(result(rupture_speed=np.nan, **unknown), PROBLEM)
    assert "nan" not in text
    assert "kinetic" not in text


def test_a_film_as_mp4_without_ffmpeg_says_what_is_missing(tmp_path):
    run = xr.Dataset({name: ((), 0.0) for name in ("slip_rate", "shear_stress", "peak_strength")})
    with (
        matplotlib.rc_context({"animation.ffmpeg_path": "no-such-program"}),
        pytest.raises(InputError, match="film.mp4' needs the program ffmpeg"),
    ):
        films.film(run, tmp_path / "film.mp4")
