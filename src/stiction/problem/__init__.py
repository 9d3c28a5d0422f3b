"""The deterministic parts: the interface, its solids, friction and load, and a sample's profiles.

Read `interface`, `solid`, `specimen` and `friction` first: they
are the parts of a problem. Then read `problem`, which puts them
together, and `sample`, which holds the profiles that every method
starts from. `profiles` reads profiles from files and places them at the
nodes. `results` labels results.
"""
