"""A study: everything that defines a Monte Carlo computation, from Python or TOML.

Read `study`, the object of problem, strength, method and ensemble, then `sweep`, whose
axes turn a study into points. `run` reads runs on disk, cuts them into parts and exports
results. `failure` stores repetitions of failure curves and turns them into curves.
"""
