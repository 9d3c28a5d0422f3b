"""Theory of the local criterion and of cracks: results that do not need an ensemble."""

from stiction.methods.criterion.griffith import griffith_length
from stiction.methods.criterion.local import nucleation_stress
from stiction.statistics.moments import nucleation_statistics

__all__ = [
    "griffith_length",
    "nucleation_statistics",
    "nucleation_stress",
]


def __dir__() -> list[str]:  # what completion lists
    return __all__
