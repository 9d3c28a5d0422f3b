"""Three answers to the question at which load an interface lets go.

Read `protocol`: what every method offers, and `onset`. `criterion` takes each patch by itself,
`equilibrium` has every interaction and is exact as long as loading is slow, `dynamics` adds
inertia and begins where equilibrium ends.
"""
