"""Related functions below each docstring: everything that shares a row with it in `ROWS`."""

from stiction.methods.protocol import METHODS

ROWS = """
    Problem Solid Interface Load LinearWeakening
    LinearWeakening ExponentialWeakening PiecewiseWeakening
    RandomField RandomInterface read_profile fit_field plot.field
    Beta Lognormal Weibull Gamma TruncatedNormal
    PowerLawSpectrum SquaredExponentialSpectrum ExponentialSpectrum CustomSpectrum
    onset monte_carlo equilibrium_path simulate_rupture
    onset plot.onset
    monte_carlo Study plot.monte_carlo plot.quantiles
    simulate_rupture Save Rupture plot.rupture plot.film
    failure_probability failure_curve design_stress external.limit_state
    failure_curve plot.failure_curve
    fit_field plot.fit
    read_curve read_peaks statistics.agreement plot.precursors
    infer read_peaks design_of_tests external.simulator
    theory.nucleation_stress theory.nucleation_statistics
    Study open_run monte_carlo
"""
_RELATED = [[f"stiction.{name}" for name in row.split()] for row in ROWS.splitlines()]
_RELATED.append([f"stiction.{kind.__name__}" for kind in METHODS.values()])


def _append(app, what, name, obj, options, lines):
    related = [other for row in _RELATED if name in row for other in row if other != name]
    if related and "See Also" not in lines:
        names = ", ".join(f":obj:`~{other}`" for other in dict.fromkeys(related))
        lines += ["", "See Also", "--------", names]


def setup(app):
    # Before numpydoc, which turns the section into a box.
    app.connect("autodoc-process-docstring", _append, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
