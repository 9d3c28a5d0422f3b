"""A study: everything that defines a Monte Carlo computation, from Python or TOML.

Read `study` first: it joins problem, strength, method and number of samples.
Then read `sweep`, whose axes turn a study into points. `reading` reads
TOML files, and the files that they name. `run` reads runs on disk,
divides them into parts and exports results.
"""
