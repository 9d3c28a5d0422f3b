"""A study: everything that defines a Monte Carlo computation, from Python or TOML.

Read `study`, one object for problem, strength, method and ensemble, then `sweep`, whose axes make
points of it. `run` reads runs on disk and cuts them into parts; `failure` is the same of failure
curves; `question` is what a study asks of its failure probability; `export` writes results.
"""
