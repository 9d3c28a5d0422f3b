"""Symbols in running text: 'tau_cr' as the reader knows it from print."""

from __future__ import annotations

import re

from markupsafe import Markup, escape

_GREEK = {
    "tau": "\N{GREEK SMALL LETTER TAU}",
    "xi": "\N{GREEK SMALL LETTER XI}",
    "lambda": "\N{GREEK SMALL LETTER LAMDA}",
    "nu": "\N{GREEK SMALL LETTER NU}",
    "pi": "\N{GREEK SMALL LETTER PI}",
    "rho": "\N{GREEK SMALL LETTER RHO}",
    "Gamma": "\N{GREEK CAPITAL LETTER GAMMA}",
}
_SUBSCRIPTED = re.compile(
    r"\b(tau|xi|lambda|Gamma|[hxcvdCSL])_(p,max|p|n|cr|r|kin|0|s|d|R|c|z|tau|max|i)\b"
)
_PLAIN = re.compile(r"\b(lambda|Gamma|nu|pi|xi|tau|rho)\b")
_POWER = re.compile(r"\^(\d+|-\d+|\*)")


def mathematics(text: str) -> Markup:
    """Plain text as HTML, with symbols such as tau_cr, xi_0/h_n, G*, c_s^2 set as such."""
    html = str(escape(text))
    html = _SUBSCRIPTED.sub(
        lambda m: f"<i>{_GREEK.get(m[1], m[1])}</i><sub>{_GREEK.get(m[2], m[2])}</sub>", html
    )
    html = _PLAIN.sub(lambda m: f"<i>{_GREEK[m[1]]}</i>", html)
    html = _POWER.sub(lambda m: f"<sup>{m[1].replace('-', chr(0x2212))}</sup>", html)
    html = html.replace("G*", "<i>G</i>*").replace("&lt;", "\N{LEFT-POINTING ANGLE BRACKET}")
    return Markup(html.replace("&gt;", "\N{RIGHT-POINTING ANGLE BRACKET}"))
