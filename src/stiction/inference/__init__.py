"""From measurements to random fields: fits of profiles, parameters from peaks, designs of tests.

Profiles: read `fit` and `estimate`, then `records` and `window` (what was measured), `whittle` (its
likelihood), `marginal_fit`, `bootstrap` (errors) and `between` (specimens). Peaks: read `infer`,
then `prior`, `likelihood` with `scaling` and `density`, `grid` and `posterior`; `joined` weighs
interfaces that a fit leaves. `agreement` tests a prediction, `design` plans tests.
"""
