"""A study: everything that defines a Monte Carlo computation, from Python or TOML.

Read `study` first: it joins problem, strength, method and number of
samples, and reads TOML files, and the files that they name. Then read
`sweep`, whose axes turn a study into points. `run` reads runs on disk,
divides them into parts and exports results.
"""
