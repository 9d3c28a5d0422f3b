"""Failure probability: how likely does the interface slide below a given stress?"""
