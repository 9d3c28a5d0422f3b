"""What is random: marginals, spectra, and profiles by (seed, sample).

Read `fields`: a `RandomField`, and the `RandomInterface` that holds several; then
`marginals`, `spectra` and `mapping` between the two, `modes` (waves on an interface) and
`synthesis` (draws and transforms). `conditioning` and `transport` take what was measured
into account, `equally_likely` a list of interfaces; `dotted_keys` finds parameters,
`stresses` multiplies by the pressure.
"""
