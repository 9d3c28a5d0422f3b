"""Albertini, Karrer, Grigoriu and Kammer (2020), recomputed: studies, claims, figures and a page.

Plain scripts on public names of `stiction`; copy a study from here for a problem of your own.
"""
