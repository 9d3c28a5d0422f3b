"""Random properties: marginals, spectra, and profiles by (seed, sample).

Read `fields` first: a `RandomField`, and the `RandomInterface` with several fields. Then read
`marginals`, `spectra`, `mapping` (from the Gaussian field to the property), `modes` (waves on an
interface) and `synthesis` (draws and transforms). `conditioning` and `transport` take measured
values into account, and `equally_likely` a list of interfaces. `dotted_keys` finds parameters, and
`stresses` multiplies coefficients by the pressure.
"""
