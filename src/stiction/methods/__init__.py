"""Three methods that compute the load at which an interface begins to slide.

Read `protocol`, which defines the members of every method, and `onset`.
`criterion` treats each patch in isolation. `equilibrium` includes all
interactions, and is exact if loading is slow. `dynamics` adds inertia,
and starts where equilibrium ends.
"""
