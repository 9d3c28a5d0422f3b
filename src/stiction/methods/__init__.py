"""Three methods for the load at which an interface begins to slide.

Read `protocol`, the members of every method, and `onset`. `criterion` takes each
patch by itself. `equilibrium` has every interaction and is exact as long as
loading is slow. `dynamics` adds inertia, and starts from the end of equilibrium.
"""
