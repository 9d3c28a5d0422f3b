"""A joint whose factor between specimens is known, for tests of designs."""

import stiction as st

PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 64, width=0.01),
    st.LinearWeakening(weakening_rate=0.25e12, residual_ratio=0.4),
    load=st.Load(normal_pressure=5e6),
)
FIELD = st.RandomField(
    st.Gamma(mean=0.2, cv=0.15), st.PowerLawSpectrum(4e-3), of="friction_coefficient",
    mean_mode=True,
)  # fmt: skip
RANDOM = st.RandomInterface(strength=FIELD, between={"strength": st.Lognormal(mean=1, cv=0.1)})
GIVEN = {"method": st.LocalCriterion(), "progress": False, "target_cv": 0.2}
