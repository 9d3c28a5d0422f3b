"""What this machine has no memory for is refused before it is begun."""

import pytest

import stiction as st
from stiction.reliability import subset

PLANE = st.Interface(length=(0.5, 0.5), nodes=(4096, 4096))
STRENGTH = st.RandomField(
    st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
    st.PowerLawSpectrum(correlation_length=2e-3),
)


def test_samples_of_a_large_plane():
    for make in (STRENGTH.sample, st.RandomInterface(strength=STRENGTH).profiles):
        with pytest.raises(st.InputError, match=r"samples: this takes .* GiB of memory"):
            make(PLANE, samples=10**6)


def test_subset_simulation_with_very_many_draws():
    with pytest.raises(st.InputError, match=r"subset.*GiB of memory.*fewer nodes"):
        subset.descend(lambda draws: draws[:, 0], 10**9, rng=None, samples=1000)
