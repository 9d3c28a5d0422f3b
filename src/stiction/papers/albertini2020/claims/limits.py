"""What a word of the paper is taken to mean in numbers, with the reason: one table for all claims.

Limits come from what the word is used for, not from what was computed.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limit:
    """A number that a word stands for.

    Attributes
    ----------
    word : str
        What the paper writes.
    value : float
    unit : str
    reason : str
    """

    word: str
    value: float
    unit: str
    reason: str

    @property
    def text(self) -> str:
        """'1 % (quantitatively well)'."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.value:g}{unit} ({self.word})"


WELL = Limit(
    "well predicted, coincide, minor", 1.0, "%",
    "samples differ by about 3 %: an error of a third of that still tells them apart, and a plot of"
    " two columns' width cannot show it",
)  # fmt: skip
ACCURATE_MEAN = Limit(
    "accurate mean", 1.0, "%", "as for a single prediction: a third of what samples differ by"
)
ACCURATE_SPREAD = Limit(
    "accurate spread", 10.0, "%",
    "a spread is known to 1/sqrt(2 N): 60 simulations would not show 9 %",
)  # fmt: skip
SCATTER = Limit(
    "correctly, very similar", 3.0, "%", "what samples differ by: the point stays where it belongs"
)
RARE = Limit(
    "extremely rare, extremely unlikely", 0.01, "",
    "60 simulations without one would not be surprising (probability 0.55)",
)  # fmt: skip
UNCOMMON = Limit(
    "not a feature", 0.1, "",
    "60 simulations would show it with certainty (probability 0.998)",
)  # fmt: skip
COMMON = Limit(
    "may happen, not necessarily", 0.01, "", "one interface in a hundred is not an exception"
)
MOST = Limit("most, caused by, likely the cause", 0.5, "", "more than half")
PART = Limit("a part", 0.05, "", "one part in twenty is visible beside the rest")
GAUSSIAN = Limit(
    "similar to a Gaussian", 0.05, "",
    "two distribution functions that differ by less cannot be told apart by 700 values at the 5 %"
    " level, nor by eye in a plot of densities",
)  # fmt: skip
ALIKE = Limit(
    "about equal", 0.05, "",
    "a correlation estimated from one interface of 30 nucleation lengths scatters by more",
)  # fmt: skip
SAME_MEMORY = Limit(
    "a measure of memory", 2.0, "", "two definitions of one length that differ by less than twice"
)
CLOSE_TO_BOUND = Limit(
    "close to the lower bound", 0.25, "",
    "in the lower quarter of the way from the lower to the upper bound; the median of the strength"
    " itself is at 0.31",
)  # fmt: skip
AT_BOUND = Limit(
    "tends to, becomes", 0.01, "", "what is left would not be seen in a plot from 0.6 to 1.7"
)
AS_ONE = Limit(
    "the same as", 0.1, "%", "the smallest of the errors that the paper could see is ten times that"
)
CONVERGED = Limit("converged", 0.5, "%", "half of the error allowed to a prediction")
SAME_LENGTH = Limit(
    "unique and uniform", 0.1, "", "ten per cent of h_n are three nodes of the grid of the paper"
)
ALMOST_ALL = Limit("always", 0.95, "", "all but one in twenty")
DAUNTING = Limit("daunting", 24.0, "h", "what is done over night is not daunting")
HOURS = Limit("hours", 0.5, "h", "what takes longer than a break is not routine either")
MUCH_LONGER = Limit(
    "considerably larger", 10.0, "", "an order of magnitude: what the word stands for in physics"
)
CONSIDERABLE = Limit("considerable time", 2.0, "", "half of the time, or more, is saved")
SLOPE = Limit(
    "proportional to", 0.05, "", "an exponent of 1 to 5 % cannot be told from 1 over a decade"
)
RESOLVED = Limit(
    "accurately",
    0.02,
    "",
    "two per cent of a spread: narrower than a line in the plot of densities",
)
SLIGHT = Limit(
    "slightly", 0.05, "", "what grows from never to one sample in twenty has grown slightly"
)
OFTEN = Limit("would come first", 0.5, "", "one small event in every other sample")
NARROW = Limit("concentrates on", 0.2, "", "a fifth of the width: four per cent of the variance")
CERTAIN = Limit(
    "distributed as", 0.01, "", "by chance a true statement is rejected once in a hundred reports"
)
TWO_SIGMAS = Limit(
    "of 60", 2.0, "", "standard deviations of a count: 19 of 20 repetitions lie within"
)
ONE_PER_CENT = Limit("equals", 0.01, "", "the derivation is exact; what is left is the grid's")

LIMITS = {name: value for name, value in globals().items() if isinstance(value, Limit)}
"""All of them by name."""
