"""Random properties: marginals, spectra, and profiles that depend on (seed, sample).

Read `fields` first. It defines a `RandomField`, and a `RandomInterface`
with several fields. Then read `marginals`, `spectra`, `mapping` (from
the Gaussian field to the property) and `synthesis` (waves on an
interface, their draws and their sum). `conditioning` takes
measured values into account. `equally_likely` holds mixtures of
interfaces. `dotted_keys` finds parameters by name. `stresses`
multiplies friction coefficients by the pressure.
"""
