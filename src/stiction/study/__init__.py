"""A study: everything that defines a Monte Carlo computation, from Python or TOML.

Read `study`, one object for problem, strength, method and ensemble, then `sweep`, whose
axes make points of it. `run` reads runs on disk and cuts them into parts; `failure` stores
repetitions of failure curves, and makes curves of them; `export` writes results.
"""
