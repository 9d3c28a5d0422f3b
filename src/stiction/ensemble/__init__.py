"""Ensembles: the samples of a study, and their computation."""
