"""Random fields: marginal distributions, spectra and the sampler."""
