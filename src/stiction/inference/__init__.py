"""From measurements to parameters, and to how far they may be trusted."""
