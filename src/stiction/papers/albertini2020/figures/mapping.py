"""Figure 2: the mapping from the Gaussian field to strength, and the spectrum."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import norm

from stiction.papers.albertini2020.data import Data
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, color, new_figure, panel
from stiction.random.marginals import quantile_of_normal
from stiction.report.tables import Table

name = "mapping"
number = "2"
title = "Mapping and spectrum of the random strength"
needs: tuple[str, ...] = ()

_PAIRS = (-1.2, 0.9)


def caption(data: Data) -> str:
    """What is seen."""
    kept = data.setting.spectrum(data.ratios[0]).power_kept_by_truncation
    return (
        "(a, b) A value z of the Gaussian field becomes the strength of equal cumulative"
        " probability; two such pairs are marked. (c) Power spectral density of z against the"
        " wavenumber in units of the cutoff"
        " \N{GREEK SMALL LETTER LAMDA} = 2\N{GREEK SMALL LETTER PI}/\N{GREEK SMALL LETTER XI}"
        f"\N{SUBSCRIPT ZERO}: a power law beyond it, truncated where {kept:.4f} of the power is"
        " kept."
    )


def tables(data: Data) -> list[Table]:
    """The mapping and the spectrum at a few points."""
    z = np.arange(-4.0, 4.01, 0.25)
    tau = quantile_of_normal(data.setting.marginal.distribution, z)
    spectrum = data.setting.spectrum(data.ratios[0])
    k = np.geomspace(0.1, 10.0, 41)
    return [
        Table.of(
            "figure-2-mapping",
            "Strength of equal cumulative probability",
            ("z", "cumulative probability", "tau_p (Pa)"),
            zip(z, norm.cdf(z), tau, strict=True),
        ),
        Table.of(
            "figure-2-spectrum",
            "Power spectral density",
            ("k/lambda", "g(k)/g(0)"),
            zip(k, spectrum.density(k * spectrum.cutoff_wavenumber), strict=True),
        ),
    ]


def draw(data: Data) -> Figure:
    """Both distribution functions beside each other, and the spectrum."""
    setting = data.setting
    distribution = setting.marginal.distribution
    figure = new_figure(PAGE, 2.35)
    normal, strength, spectral = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.15))
    z = np.linspace(-3.6, 3.6, 400)
    normal.plot(z, norm.cdf(z), color=INK)
    normal.set_xlabel("Gaussian variable $z$")
    normal.set_ylabel(r"cumulative probability")
    normal.text(-3.4, 0.93, r"$\Phi(z)$")
    low, high = distribution.ppf([1e-6, 1.0 - 1e-6])
    room = 0.08 * (high - low)
    tau = np.linspace(low - room, high + room, 400)
    strength.plot(tau / setting.mean, distribution.cdf(tau), color=INK)
    strength.set_xlabel(r"strength $\tau_\mathrm{p}/\langle\tau_\mathrm{p}\rangle$")
    strength.text(0.04, 0.93, r"$F(\tau_\mathrm{p})$", transform=strength.transAxes)
    strength.tick_params(labelleft=False)
    for axes in (normal, strength):
        axes.set_ylim(-0.03, 1.06)
    for pair, shade, symbol in zip(_PAIRS, (color(1), ACCENT), ("o", "s"), strict=True):
        share = norm.cdf(pair)
        mapped = float(quantile_of_normal(distribution, np.array([pair]))[0]) / setting.mean
        edge_left, edge_right = normal.get_xlim()[1], strength.get_xlim()[0]
        line = {"color": shade, "linewidth": 0.8, "linestyle": (0, (4, 2)), "clip_on": False}
        normal.plot([pair, pair], [-0.03, share], **line)
        normal.plot([pair, edge_left], [share, share], **line)
        strength.plot([edge_right, mapped], [share, share], **line)
        strength.plot([mapped, mapped], [share, -0.03], **line)
        normal.plot([pair], [share], symbol, color=shade)
        strength.plot([mapped], [share], symbol, color=shade)
        normal.set_xlim(right=edge_left)
        strength.set_xlim(left=edge_right)
    spectrum = setting.spectrum(data.ratios[0])
    unit = spectrum.cutoff_wavenumber
    k = np.geomspace(0.1, 10.0, 400)
    end = spectrum.cutoff / unit
    inside = k <= end
    spectral.loglog(k[inside], spectrum.density(k[inside] * unit), color=INK)
    spectral.loglog(
        k, spectrum.density(k * unit), color=QUIET, linewidth=0.8, linestyle=(0, (4, 2))
    )
    spectral.axvline(1.0, color=PALE, linewidth=0.8, zorder=0)
    spectral.axvline(end, color=PALE, linewidth=0.8, zorder=0)
    bottom = float(spectrum.density(np.array([10.0 * unit]))[0])
    spectral.set_ylim(bottom, 4.0)
    spectral.text(0.93, bottom * 3, r"$\lambda$", ha="right", va="bottom")
    spectral.text(end * 0.93, bottom * 3, r"$\bar k$", ha="right", va="bottom")
    slope = 2.0 * spectrum.exponent
    here = 4.2
    spectral.text(
        here * 1.12,
        float(spectrum.density(np.array([here * unit]))[0]),
        rf"$\propto k^{{-{slope:g}}}$",
        ha="left",
        va="bottom",
    )
    spectral.set_xlim(0.1, 10.0)
    spectral.set_xlabel(r"wavenumber $k/\lambda$")
    spectral.set_ylabel(r"spectral density $g(k)/g(0)$")
    for axes, letter in zip((normal, strength, spectral), "abc", strict=True):
        panel(axes, letter)
    return figure
