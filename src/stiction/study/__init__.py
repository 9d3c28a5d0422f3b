"""A study: everything that defines a Monte Carlo computation, from Python or TOML."""
