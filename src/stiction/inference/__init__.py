"""Fit random fields to profiles, infer parameters from peaks, and design tests.

Profiles: begin with `fit` and `estimate`. Then read `records` and
`window` (measured values), `whittle` (their likelihood),
`marginal_fit`, `bootstrap` (errors) and `between` (specimens).

Peaks: begin with `infer`. Then read `prior`, `likelihood` with
`scaling` and `density`, `grid` and `posterior`. `specimens` combines
profiles and peaks. `agreement` tests a prediction, and `design` plans
tests. `peaks` and `curves` read the files of tests.
"""
