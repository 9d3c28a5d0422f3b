"""Recorded refusals and doubts of profiles, tables, studies, fits and laws of others.

The calls stand in mistakes_in_files.json, each beside the arguments that its refusal names.
"""

import struct
from collections import namedtuple
from pathlib import Path

import numpy as np
import setups
import small_study as studies
import xarray as xr
from recording import inside, mistakes, refusals, stored
from setups import LOCAL, make_problem
from small_study import altered, small_study

import stiction as st
from stiction.base.model import model
from stiction.problem.friction import FrictionLaw

NODES = 128
LINE, PLANE = st.Interface(0.1, NODES), st.Interface((0.02, 0.01), (32, 16))
X = LINE.x
SYSTEM = make_problem(NODES, weakening_rate=0.15e12)
STRENGTH = 1e6 - 4e5 * np.exp(-(((X - 0.06) / 4e-3) ** 2)) + 1e6 * X
MAP = xr.DataArray(np.full((32, 16), 1e6), PLANE.coordinates, ("x", "y"), name="strength")


def labelled(strength=STRENGTH, x=X, **attributes):
    return xr.DataArray(strength, dims="x", coords={"x": x}, attrs=attributes)


def without(*gone):
    return np.where(np.isin(np.arange(NODES), gone), np.nan, STRENGTH)


def onset(strength, system=SYSTEM, **options):
    return st.onset(system, strength, method=LOCAL, **options)


def read(text, name="p.csv", interface=LINE, **options):
    """What is read from a file of its own."""
    with inside():
        Path(name).write_bytes(text if isinstance(text, bytes) else text.encode())
        return st.read_profile(name, interface=interface, **options)


def binary(content, name="p.npy"):
    """The same without what numpy or zipfile adds, which has other words in other versions."""
    try:
        read(content, name)
    except st.InputError as error:
        raise st.InputError(str(error).split(" numbers:")[0]) from error


def peaks(text, **options):
    with inside():
        Path("peaks.csv").write_text(text)
        return st.read_peaks("peaks.csv", **options)


def slips(heading, *, count=6, normal="clamping force (kN)", **options):
    """Two slip loads of each specimen, over the clamping forces beside them."""
    rows = [f"{1 + k // 2};{160.0 + 7.0 * (k % 3)};{390.0 + k}" for k in range(count)]
    return peaks("\n".join([heading, *rows]), normal=normal, **options)


def npy(shape, payload=b"", dtype="<f8", version=b"\x01\x00", extra=""):
    header = f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape!r}, {extra}}}\n"
    return b"\x93NUMPY" + version + struct.pack("<H", len(header)) + header.encode() + payload


def columns(**options):
    """A table of four columns and one that nobody asks for."""
    rows = zip(X, X * 1e3, STRENGTH, STRENGTH * 1e-6, strict=True)
    lines = [";".join(f"{value:.12g}" for value in row) + ";3.4.2024 12:03" for row in rows]
    head = "time (s);Weg (mm);height (um);Local strength [MPa];date"
    return read("\n".join([head, *lines]), **{"interface": None} | options)


def of_map(values, heading="x (mm); y (mm); strength (MPa)", name="m.csv"):
    """A map as a table, or as it is."""
    if isinstance(values, bytes | str):
        return read(values, name, PLANE)
    x, y = np.meshgrid(*PLANE.coordinates.values(), indexing="ij")
    table = np.column_stack([1e3 * x.ravel(), 1e3 * y.ravel(), values.ravel()])
    rows = [";".join(map(str, row)) for row in table]
    return read("\n".join([heading, *rows]), name, PLANE)


def studied(**changes):
    """The small study with other values, by keys whose dots are written as __."""
    study = altered(small_study(64), **changes)
    with inside():
        rows = [f"{1e3 * x};{1e-3 * (1e5 + 1e6 * x)}" for x in X[:64]]
        Path("tau_r.csv").write_text("\n".join(["x (mm);tau_r (kPa)", *rows]))
        Path("load.csv").write_text("x (m);profile\n0;1\n0.05;1.1\n")
        return st.Study.from_dict(study, folder=".")


def swept(*axes):
    return studied(sweep=list(axes))


def loaded(profile):
    return studied(problem__load={"profile": profile})


def scanned(**given):
    known = {"profile": "tau_r.csv", "noise": 1e3} | given
    return studied(random__strength__conditions={k: v for k, v in known.items() if v})


BETWEEN = {"type": "lognormal", "mean": 1.0, "cv": 0.1}
LENGTH = "random.strength.spectrum.correlation_length"
COUNT, SPACING = 400, 2e-4
PIECE = st.Interface(COUNT * SPACING, COUNT)
FIELD = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3), True)
VALUES = FIELD.sample(st.Interface(3 * COUNT * SPACING, 3 * COUNT), seed=5)[0, :COUNT]


def fitted(values=VALUES, x=PIECE.x, spectrum="exponential", **options):
    quick = {"marginal": "lognormal", "noise": False, "bootstrap": 20, "progress": False}
    return st.fit_field(labelled(values, x, units="Pa"), spectrum=spectrum, **quick | options)


def own_law(shape, slip_at, area=np.asarray, slope=1.0, name="initial_slope"):
    """A law as somebody else would write it: f and its slope, its inverse and its integral."""
    fields = namedtuple("Fields", [name], defaults=[slope])
    parameters_type = type("Parameters", (fields,), {"f": shape, "__slots__": ()})

    @model
    class Own(FrictionLaw):
        parameters = parameters_type()

        def area(self, u):
            return area(np.asarray(u, dtype=float))

        def slip_at(self, fraction):
            return slip_at(fraction)

    return Own(weakening_rate=0.5e12)


def logarithm(fraction):
    return -np.log(fraction) if fraction > 0.0 else np.inf


def exponential(law, u):
    return np.exp(-u), np.exp(-u)


def exponential_area(u):
    return 1.0 - np.exp(-u)


def hump(law, u):
    return (1.0 - 0.1 * u, 0.1) if u < 0.2 else (1.0 + 0.1 * np.sin(20.0 * u), 0.1)


def flat(law, u):
    return 0.5 + 0.5 * np.cos(np.pi * u), 0.5 * np.pi * np.sin(np.pi * u)


def endless(law, u):
    return 1.0 / (1.0 + u), (1.0 + u) ** -2


OWN = [own_law(*eval(law)) for law in stored("cases")["own laws"]]


@model
class Sketch(type(OWN[-1])):
    """A law without a compiled strength."""

    parameters = ()


def with_law(law):
    return make_problem(512, 0.05, friction=law)


SCOPE = vars(setups) | vars(studies)
test_each_mistake_is_refused_as_recorded = mistakes(__file__, SCOPE | globals())
test_a_refusal_holds_the_words_that_lead_on = refusals("words", SCOPE | globals())
