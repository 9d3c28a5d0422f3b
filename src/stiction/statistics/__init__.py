"""Statistics of strength and onset: moments and limits, densities, quantiles, extremes."""
