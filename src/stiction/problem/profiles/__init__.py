"""Profiles along the interface: reading from files and arrays, units, and placing at the nodes."""
