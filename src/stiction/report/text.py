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
_MINUS = "\N{MINUS SIGN}"
# One pass, longest first, so that nothing is set twice.
_SYMBOL = re.compile(
    r"\b(?P<base>tau|xi|lambda|Gamma|[hxcvdCSL])_(?P<index>p,max|kin|max|cr|tau|[pnr0sdRczi])\b"
    r"|\b(?P<greek>lambda|Gamma|tau|rho|xi|nu|pi)\b"
    r"|(?<![\w.'-])(?P<letter>[GWLCFzk])(?![\w'])"
    r"|\^(?P<power>-?\d+)"
    r"|&lt;(?P<mean>[a-zA-Z]+_[a-z]+|tau)&gt;"
    r"|(?P<much>&gt;&gt;)"
    r"|(?<![\w.)])-(?P<negative>\d)"
)


def _set(match: re.Match[str]) -> str:
    part = match.groupdict()
    if part["base"]:
        base, index = (_GREEK.get(part[key], part[key]) for key in ("base", "index"))
        return f"<i>{base}</i><sub>{index}</sub>"
    if part["greek"] or part["letter"]:
        name = part["greek"] or part["letter"]
        return f"<i>{_GREEK.get(name, name)}</i>"
    if part["power"]:
        return f"<sup>{part['power'].replace('-', _MINUS)}</sup>"
    if part["mean"]:
        inner = _SYMBOL.sub(_set, part["mean"])
        return f"\N{MATHEMATICAL LEFT ANGLE BRACKET}{inner}\N{MATHEMATICAL RIGHT ANGLE BRACKET}"
    if part["much"]:
        return "\N{MUCH GREATER-THAN}"
    return _MINUS + part["negative"]


def mathematics(text: str) -> Markup:
    """Plain text as HTML, with symbols such as tau_cr, <tau_p>, xi_0/h_n, G*, k^-8 set as such."""
    return Markup(_SYMBOL.sub(_set, str(escape(text))))
