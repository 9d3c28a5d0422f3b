"""A joint whose factor between specimens is known, for tests of designs."""

from setups import LOCAL, make_problem

import stiction as st

LAW = {"weakening_rate": 0.25e12, "residual_ratio": 0.4}
PROBLEM = make_problem(64, 0.05, width=0.01, load=st.Load(normal_pressure=5e6), **LAW)
FIELD = st.RandomField(
    st.Gamma(mean=0.2, cv=0.15), st.PowerLawSpectrum(4e-3), quantity="friction_coefficient",
    mean_mode=True,
)  # fmt: skip
RANDOM = st.RandomInterface(strength=FIELD, between={"strength": st.Lognormal(mean=1, cv=0.1)})
GIVEN = {"method": LOCAL, "progress": False, "target_cv": 0.2}
