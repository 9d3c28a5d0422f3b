"""Characteristic and design values of slip factors by the standards, for comparison.

Problem. Given n slip factors with mean m and standard deviation s, what
do the standards state?

Sources, from memory and not yet compared with the printed standards:
EN 1990:2002, annex D, tables D1 and D2 for an unknown coefficient of
variation. EN 1090-2:2018, annex G.

Steps:

1. EN 1990 D7.2: characteristic value m - k s, with
   k = t sqrt(1 + 1/n), where t is the 95 % quantile of Student's
   distribution with n - 1 degrees of freedom.
2. EN 1990 D7.3: design value m - k_d s, with the same k_d for the
   99.9 % quantile. This is the 'about 0.1 %' of 0.8 times the
   reliability index 3.8.
3. EN 1090-2 G: characteristic value m - 2.05 s of ten slip loads from
   five specimens. If s exceeds 8 % of m, more than (s/3.5)^2 specimens
   are tested in all, with s in per cent of m.

A design by specimens, averaged over families, differs. In step 1, 5 % of
the slip loads are below the value if they are normal and each counts as a
specimen. Step 2 leaves out families with a heavier lower tail. Step 3
takes ten slip loads as independent, with a fixed factor, and its number
of specimens depends on the scatter alone, not on the probability.
"""

import math

from scipy.stats import t

from stiction.base.arrays import Array

DESIGN = 1e-3
"""Probability below the design value of EN 1990."""
SCATTERS, PER_SPECIMEN = 0.08, 3.5
"""Coefficient of variation above which EN 1090-2 asks for more
specimens, and its divisor, %."""


def fractile_factor(count: int, probability: float = 0.05) -> float:
    """Return k in the value m - k s, for a number of results (steps 1 and 2).

    Student's distributions with 4 and 3 degrees of freedom have the 95 %
    quantiles 2.132 and 2.353:

    >>> [round(fractile_factor(count), 3) for count in (5, 4)]
    [2.335, 2.631]
    >>> round(fractile_factor(2, 0.25), 4)  # tan(pi/4) sqrt(1.5)
    1.2247
    """
    return float(t.isf(probability, count - 1) * math.sqrt(1.0 + 1.0 / count))


def standards_of(factors: Array) -> dict[str, float]:
    """Return mean, standard deviation and the values of the standards (steps 1 to 3).

    The 95 % and 99.9 % quantiles with 3 degrees of freedom are 2.353 and
    10.215. The coefficient of variation is 19.8 %, and (19.8/3.5)² = 31.9:

    >>> from numpy import array
    >>> found = standards_of(array([0.30, 0.40, 0.44, 0.30]))
    >>> [round(value, 3) for value in found.values()]
    [0.36, 0.071, 0.173, -0.453, 0.214, 32.0]

    Five specimens are enough up to 8 %. At 8.2 %, six are needed:

    >>> for away in (0.0395, 0.041):
    ...     found = standards_of(array([0.5 - away, 0.5, 0.5 + away]))
    ...     print(found["EN 1090-2 specimens in all"])
    5.0
    6.0
    """
    mean, deviation, count = float(factors.mean()), float(factors.std(ddof=1)), factors.size
    further = math.floor((100.0 * deviation / mean / PER_SPECIMEN) ** 2) + 1
    specimens = max(5, further) if deviation > SCATTERS * mean else 5
    return {
        "mean": mean,
        "standard deviation": deviation,
        "EN 1990 characteristic value": mean - fractile_factor(count) * deviation,
        "EN 1990 design value": mean - fractile_factor(count, DESIGN) * deviation,
        "EN 1090-2 characteristic value": mean - 2.05 * deviation,
        "EN 1090-2 specimens in all": float(specimens),
    }
