"""What do correlation length, spread and friction do to an interface? Sliders, and the answer.

    python -m pip install panel
    python examples/explorer.py

serves a page on this machine only; Ctrl-C ends it.
"""

import math

import matplotlib.pyplot as plt
import numpy as np
import panel as pn

import stiction as st

SAMPLES = 1000
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")
SLIDERS = {  # text, lowest, highest, step, start
    "correlation_length": ("correlation length (mm)", 0.3, 15.0, 0.1, 1.5),
    "mean": ("mean strength (MPa)", 0.5, 2.0, 0.05, 1.0),
    "cv": ("coefficient of variation of the strength", 0.02, 0.4, 0.01, 0.2),
    "low": ("lowest strength (MPa)", 0.0, 0.9, 0.05, 0.6),
    "residual": ("residual strength (MPa)", 0.0, 0.6, 0.05, 0.0),
    "critical_slip": ("critical slip at the mean strength (µm)", 0.5, 6.0, 0.1, 2.0),
    "pressure": ("normal pressure (MPa)", 1.0, 20.0, 0.5, 5.0),
    "length": ("length of the interface (mm)", 20.0, 200.0, 5.0, 100.0),
    "load": ("load, as a share of the onset", 0.7, 0.999, 0.001, 0.98),
    "sample": ("sample shown", 0, 99, 1, 0),
}


def parts(v: dict) -> tuple[st.Problem, st.RandomField]:
    """Return the problem and the random strength of slider values."""
    spectrum = st.PowerLawSpectrum(correlation_length=v["correlation_length"] * 1e-3)
    marginal = st.Lognormal(mean=v["mean"] * 1e6, cv=v["cv"], low=v["low"] * 1e6)
    friction = st.LinearWeakening(
        weakening_rate=(v["mean"] - v["residual"]) * 1e12 / v["critical_slip"],
        residual_strength=v["residual"] * 1e6,
    )
    length, load = v["length"] * 1e-3, st.Load(normal_pressure=v["pressure"] * 1e6)
    coarse = st.Problem(SOLID, st.Interface(length=length, nodes=4096), friction, load)
    # 20 nodes in a nucleation length, and all of the spectrum.
    waves = spectrum.cutoff() * length / math.pi
    wanted = max(20 * length / coarse.nucleation_length, waves)
    nodes = int(np.clip(2 ** math.ceil(math.log2(wanted)), 256, 4096))
    problem = st.Problem(SOLID, st.Interface(length=length, nodes=nodes), friction, load)
    return problem, st.RandomField(marginal, spectrum)


def answer(**v):
    """Return what the page shows for slider values."""
    try:
        problem, strength = parts(v)
        options = {"samples": SAMPLES, "pilot": False, "progress": False}
        many = st.monte_carlo(problem, strength, method=st.LocalCriterion(), **options)
        tau_p = strength.sample(problem.interface, first=v["sample"], seed=0)[0]
        exact = st.onset(problem, tau_p, method=st.Equilibrium(), progress=False)
        load = v["load"] * float(exact.first_instability[0])
        path = st.equilibrium_path(problem, tau_p, [load]).isel(load=0)
    except st.InputError as error:
        return pn.pane.Alert("\n\n".join(error.problems), alert_type="danger")
    coefficients = np.sort(many.friction_coefficient.values)
    low, middle, high = np.quantile(coefficients, [0.05, 0.5, 0.95])
    stress, place = float(exact.critical_stress[0]), float(exact.critical_position[0])
    text = (
        f"Static friction coefficient **{middle:.4f}** (median of {SAMPLES:,} samples by the local"
        f" criterion; 5 to 95 %: {low:.4f} to {high:.4f}). The sample shown slides at"
        f" {stress * 1e-6:.4f} MPa from {place * 1e3:.1f} mm. Nucleation length"
        f" {problem.nucleation_length * 1e3:.2f} mm, {problem.interface.size} nodes."
    )
    figure, (profile, slip, tail) = plt.subplots(3, 1, figsize=(8, 8), layout="constrained")
    plt.close(figure)
    x = problem.interface.x * 1e3
    profile.plot(x, tau_p * 1e-6, lw=0.8, color="#a0a8b0", label="strength")
    average = np.ravel(st.theory.nucleation_stress(problem, tau_p))
    profile.plot(x, average * 1e-6, label="nucleation stress")
    profile.plot(x, path.stress * 1e-6, label="shear stress now")
    profile.plot(place * 1e3, stress * 1e-6, "o", color="#b5322a", label="exact onset")
    profile.set(ylabel="MPa")
    profile.legend(ncols=4, loc="upper center")
    slip.fill_between(x, path.slip * 1e6, color="#b5322a", alpha=0.7)
    slip.set(xlabel="position (mm)", ylabel="slip at this load (µm)", ylim=(0, None))
    tail.semilogy(coefficients, (np.arange(SAMPLES) + 1) / SAMPLES, drawstyle="steps-post")
    tail.set(xlabel="static friction coefficient", ylabel="share of samples below")
    return pn.Column(text, pn.pane.Matplotlib(figure, tight=True, sizing_mode="scale_width"))


def page():
    """Return a page for one visitor."""
    widgets = {}
    for name, (text, low, high, step, start) in SLIDERS.items():
        kind = pn.widgets.IntSlider if isinstance(step, int) else pn.widgets.FloatSlider
        widgets[name] = kind(name=text, start=low, end=high, step=step, value=start)
    moved = {name: widget.param.value_throttled for name, widget in widgets.items()}
    return pn.Row(pn.Column("# Explorer", *widgets.values()), pn.bind(answer, **moved))


if __name__ == "__main__":
    pn.extension(design="native")
    pn.serve(page, port=5006, address="127.0.0.1", show=False, title="stiction explorer")
