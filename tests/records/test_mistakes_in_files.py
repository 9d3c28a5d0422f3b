"""Recorded refusals and doubts of profiles, tables, studies, fits and laws of others."""

import dataclasses
import struct
from collections import namedtuple
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr
from recording import Calls, compared, inside, table_of
from setups import LOCAL, make_problem
from small_study import altered, lengths, small_study

import stiction as st
from stiction.base.model import model
from stiction.problem.friction import FrictionLaw

calls = Calls()
NODES = 128
LINE, PLANE = st.Interface(0.1, NODES), st.Interface((0.02, 0.01), (32, 16))
X = LINE.x
SYSTEM = make_problem(NODES, weakening_rate=0.15e12)
STRENGTH = 1e6 - 4e5 * np.exp(-(((X - 0.06) / 4e-3) ** 2)) + 1e6 * X
MAP = xr.DataArray(np.full((32, 16), 1e6), PLANE.coordinates, ("x", "y"), name="strength")
COARSE = np.linspace(0.0, 0.1, 41)[:-1] + 1e-3


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


def peaks(text):
    with inside():
        Path("peaks.csv").write_text(text)
        return st.read_peaks("peaks.csv")


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
    return lambda: studied(sweep=list(axes))


def loaded(profile):
    return lambda: studied(problem__load={"profile": profile})


def scanned(**given):
    known = {"profile": "tau_r.csv", "noise": 1e3} | given
    return lambda: studied(random__strength__given={k: v for k, v in known.items() if v})


def uncertain(**tables):
    return lambda: studied(**tables)


BETWEEN = {"type": "lognormal", "mean": 1.0, "cv": 0.1}
LENGTH = "random.strength.spectrum.correlation_length"
POWER = {"type": "power_law", "correlation_length": 3e-3}
SOME = {"count": 4, "random.strength.marginal.low": [0.58e6, 0.7e6]}
COUNT, SPACING = 400, 2e-4
PIECE = st.Interface(COUNT * SPACING, COUNT)
FIELD = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3), True)
VALUES = FIELD.sample(st.Interface(3 * COUNT * SPACING, 3 * COUNT), seed=5)[0, :COUNT]
REST = np.random.default_rng(1).standard_normal(COUNT)
GIVEN = {"type": "exponential", "correlation_length": 1e-3}


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


LAWS = [
    (hump, lambda f: 1.0 - 0.8 * f / 1.1, np.asarray, 0.1),
    (flat, lambda f: np.arccos(2.0 * f - 1.0) / np.pi, np.asarray, 0.0),
    (endless, lambda f: 1.0 / f - 1.0 if f else np.inf, np.log1p),
    (lambda law, u: (1.0 - u, 1.0 / (1.0 - u)), lambda f: 1.0 - f),
    (exponential, logarithm, exponential_area, 1.0, "scale"),
    (lambda law, u: (0.5 * np.exp(-u), 0.5 * np.exp(-u)), logarithm),
    (exponential, lambda f: f, exponential_area),
    (exponential, lambda f: 0.9 * logarithm(f), exponential_area),
    (lambda law, u: (np.exp(-u), 2.0 * np.exp(-u)), logarithm, exponential_area, 2.0),
]

OWN = [own_law(*law) for law in LAWS]


@model
class Sketch(type(OWN[-1])):
    """A law without a compiled strength."""

    parameters = ()


def with_law(law):
    return make_problem(512, 0.05, friction=law)


SMALL_PLANE = make_problem((24, 20), (0.023, 0.0164), weakening_rate=0.28e12)
TWO = {"problem.interface.nodes": [128, 256]}
# fmt: off
table_of(calls, {
    "units and names": [
        *(partial(onset, labelled(units=one)) for one in ("um", "mpa", "1", "m/s/s/")),
        lambda: onset(xr.DataArray(np.ones((NODES, NODES)), dims=("a", "b"))),
        lambda: onset({"strength": STRENGTH, "friction_coefficient": 0.1 * STRENGTH}),
        lambda: st.fit_field(STRENGTH, LINE, quantity="strenght"),
        lambda: st.read_profile(labelled().to_dataset(name="z")),
        lambda: st.read_profile(
            labelled().to_dataset(name="strength").assign(tau_i=labelled()), x=0, value=1),
        lambda: dataclasses.replace(SYSTEM, load=st.Load(
            profile=labelled().expand_dims(sample=2))),
        lambda: make_problem((NODES, NODES), (0.1, 0.1), load=st.Load(
            normal_pressure=xr.DataArray(STRENGTH, dims="time"))),
    ],
    "places": [
        *(partial(onset, labelled(x=one)) for one in (
            np.linspace(0.0, 0.1, NODES), X * 1e3, np.r_[X[0], X[0], X[2:]],
            0.1 * (X / 0.1) ** 1.1, X + 0.05 / NODES, X - 0.03 / NODES)),
        lambda: onset(labelled(np.r_[STRENGTH, 2e6], np.r_[X, 0.1])),
        lambda: onset(xr.DataArray(STRENGTH[:60], dims="x")),
        lambda: onset(labelled(STRENGTH[::2], X[::2])),
        lambda: dataclasses.replace(SYSTEM, load=st.Load(profile=labelled(1.0 + X, X * 0.99))),
        lambda: st.read_profile(labelled(1e6 + COARSE, COARSE), interface=LINE),
        lambda: st.read_profile(labelled(1e6 + COARSE, COARSE), interface=LINE, interpolate=True),
        lambda: st.read_profile(labelled(1e6 + COARSE, COARSE).drop_isel(x=[11, 12, 13, 14]),
                                interface=LINE, interpolate=True),
        lambda: st.read_profile(labelled(), interpolate=True),
    ],
    "gaps": [
        lambda: onset(labelled(np.delete(STRENGTH, 1), np.delete(X, 1))),
        lambda: st.read_profile(labelled(without(3)), interface=LINE, gaps="skip"),
        lambda: onset(labelled(STRENGTH[:63], X[:63]), gaps="fill"),
        lambda: onset(without(*range(80, 83)), gaps="fill"),
        lambda: onset(without(3), dataclasses.replace(
            SYSTEM, specimen=st.Blocks(height=0.1)), gaps="fill"),
    ],
    "texts": [partial(read, text) for text in (
        "1,5\n2,6\n", "x;tau\n0;1e6\n0.05;strong\n", "0;1\n0.05\n", "x;tau;mu\n0;1\n",
        "pos;distance;tau\n0;0;1\n", "\n# nothing\n", "x\0;tau\n", "x;tau\n0;1\n;\n0.05;1\n",
        "x;tau\nmm;Pa\nmean;1\n0;1\n", "x;tau\n0;1_000\n", "x (mm);tau (MPa)\n0;ERR\n50;1\n",
        'x,tau\n0,"1,500"\n',
    )],
    "columns": [partial(columns, **options) for options in (
        {}, {"value": "Local"}, {"value": "height", "x": 1, "interface": LINE},
        {"unit": "kPa", "x": 1}, {"quantity": "stress"}, {"value": 3, "x": 3},
    )],
    "files": [
        *(partial(binary, content) for content in (
            npy((10**15,)), npy((4,), b"x" * 31), npy((2,), b"x" * 16, dtype="|O"),
            b"\x93NUMPY\x02\x00\xff\xff\xff\xff{",
            npy((1,), b"x" * 8, extra="'a': " + "(" * 300), b"",
        )),
        partial(binary, b"x;tau", "p.xlsx"),
        *(partial(peaks, text) for text in (
            "peak\n0.71\n0.69\n0.7\n", "peak [Mstone]\n0.71\n0.69\n0.7\n",
            "a [MPa],b [MPa]\n0.7,1\n0.6,2\n0.7,1\n", "",
            "peak [MPa],stress [MPa]\n0.7,1\n0.6,2\n0.7,1\n",
            "peak [MPa],n [1]\n0.7,1\n,2\n0.7,1\n", "peak [MPa],length\n0.7,9\n0.6,2\n0.7,1\n",
            "peak [MPa],length [mm]\n0.7,9\n0.6,\n0.7,9\n",
        )),
    ],
    "maps": [
        lambda: of_map(MAP.values, "x (m); y (m); strength (MPa)"),
        lambda: of_map("\n".join(["1,2,3,4,5,6,7"] * 32)),
        lambda: of_map("x,strength\n0,1e6\n0.05,2e6\n"),
        lambda: st.read_profile(MAP.rename(x="y", y="x"), interface=PLANE),
        lambda: st.read_profile(MAP.values.T, interface=PLANE),
        lambda: st.read_profile(
            MAP.assign_coords(x=np.where(MAP.x == 0.0, np.nan, MAP.x)), interface=PLANE),
        *(partial(st.read_profile, MAP.where(MAP.y > 0.001), interface=PLANE, **one)
          for one in ({}, {"gaps": "fill"})),
        *(partial(st.onset, SMALL_PLANE, one, method=LOCAL)
          for one in (np.full((20, 24), 1e6), np.full((24, 20), np.nan))),
    ],
    "studies": [
        lambda: studied(problem__solid__densty=1.0),
        lambda: studied(problem__friction={"type": "exponentail", "critical_slip": 1e-6}),
        loaded("missing.npy"), loaded({"file": "load.csv"}), loaded("tau_r.csv"),
        loaded({"file": "tau_r.csv", "interpol": True}), loaded({"values": [1.0, 2.0]}),
        loaded({"file": "load.csv", "gaps": "drop"}),
        loaded({"file": "tau_r.csv", "quantity": "height"}),
        scanned(noise=-1.0), scanned(profile=None), scanned(nois=1.0), scanned(profile="no.csv"),
        lambda: studied(random__between={"strenght": BETWEEN}),
        lambda: studied(random__between={"strength": BETWEEN | {"mean": 1.2}}),
        lambda: studied(random__strength__given={"profile": "tau_r.csv", "noise": 1e3},
                        random__between={"strength": BETWEEN}),
        lambda: studied(problem__specimen={"height": 0.04},
                        method={"type": "rupture", "loading_rate": 3e8}),
        lambda: studied(problem__load={"normal_pressure": 2e6},
                        random__strength__of="friction_coeficient"),
    ],
    "axes": [
        swept({"random.strength.spectrum.corelation_length": [1]}),
        swept({LENGTH: [4e-3, -1.0]}), swept({LENGTH: 4e-3}), swept({LENGTH: []}),
        swept({LENGTH: [1, 2], "ensemble.seed": [1, 2, 3]}),
        swept({LENGTH: [1e-3]}, {LENGTH: [2e-3]}),
        swept({"random.strength.spectrum": []}, {LENGTH: [2e-3]}),
        swept({"ensemble.samples": [10, 20]}),
        swept({"ensemble.seed": list(range(1000))}, {"x": [1] * 1000}),
        swept({"random.correlation.strength.residual_strenght": [0.1]}),
        swept({"problem.solid.poisson_ratio": [0.2, 0.7]}, {"mehtod": [1, 2]}),
        lambda: studied(sweep={LENGTH: [1e-3], "ensemble.seed": [1]}),
        lambda: studied(sweep=[TWO], ensemble={"samples": 3, "keep": ["strength"]}),
    ],
    "uncertain": [
        uncertain(uncertain=3), uncertain(uncertain={"count": 5}), uncertain(random=[]),
        uncertain(uncertain={"marginal.low": 3}), uncertain(uncertain={"marginal.lw": [1, 2]}),
        uncertain(uncertain={"correlation_length": [1e-3, 2e-3]}, sweep=lengths(3e-3, 7e-3)),
        uncertain(uncertain={"correlation_length": [1e-3, 2e-3]}, sweep=[{
            "random.strength.spectrum": [POWER, POWER | {"correlation_length": 7e-3}]}]),
        uncertain(uncertain=SOME, random=[small_study()["random"]] * 2),
        uncertain(uncertain=SOME, sweep=[{"random.strength.marginal.low": [5e5, 6e5]}]),
        uncertain(uncertain=SOME, sweep=[{"random.strength.marginal": [
            {"type": "beta", "alpha": 1.5, "beta": 3.0, "low": 6e5, "high": one}
            for one in (1.6e6, 1.7e6)]}]),
    ],
    "fits": [
        lambda: st.fit_field(VALUES),
        lambda: fitted(x=np.repeat(PIECE.x[::2], 2)),
        lambda: fitted(x=PIECE.x**1.2),
        lambda: fitted(VALUES[:40], PIECE.x[:40]),
        lambda: fitted(np.full(COUNT, 1e6)),
        lambda: fitted(-VALUES),
        lambda: fitted(detrend=7, noise=-1.0, bootstrap=3, confidence=90, seed=-1, progress="x"),
        lambda: fitted(marginal="lognormul", spectrum={"type": "power_law", "exponnt": 2.0}),
        lambda: fitted(anisotropy=True),
        lambda: fitted(VALUES[:64], PIECE.x[:64] / 4.0, GIVEN),
        lambda: fitted(VALUES + 2e6 * (np.median(VALUES) < VALUES), spectrum=GIVEN),
        lambda: fitted(1e7 + VALUES + 3e6 * REST, noise=3e6),
        lambda: fitted(np.r_[2e7, VALUES[1:]]),
        lambda: st.infer(make_problem(), fitted(quantity="normal_pressure"), [7e5, 7.1e5, 7.3e5],
                         method=LOCAL),
    ],
    "laws of others": [
        *(partial(with_law, law) for law in OWN),
        *(partial(st.PiecewiseWeakening.from_law, law, 32) for law in OWN),
        lambda: with_law(Sketch(weakening_rate=0.5e12)),
        lambda: with_law(own_law(exponential, logarithm, exponential_area)),
    ],
})
# fmt: on

test_outputs_are_as_recorded = compared(calls, __file__)
