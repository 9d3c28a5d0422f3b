"""Ensembles: which samples there are, and how they are computed."""
