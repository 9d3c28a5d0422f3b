"""Failure probability: how likely does the interface let go below a given stress?"""
