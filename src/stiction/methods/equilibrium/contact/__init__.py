"""Equilibria of a slider whose pressure depends on load and slip."""
