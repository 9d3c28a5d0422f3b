"""Fit random fields to profiles, infer parameters from peaks, and design tests.

Profiles: begin with `fit` and `estimate`. Then read `records` and
`window` (measured values), `whittle` (their likelihood),
`marginal_fit` and `bootstrap` (errors).

Peaks: begin with `infer`. Then read `prior`, `likelihood` with
`density`, and `posterior`. `specimens` combines
profiles and peaks. `agreement` tests a prediction, and `design` plans
tests. `peaks` and `curves` read the files of tests.
"""
