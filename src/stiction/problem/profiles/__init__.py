"""Profiles along the interface: read from files and arrays, converted, placed at the nodes."""
