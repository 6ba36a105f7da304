"""Infers the mode of a wiring and rewrites a spec into another mode. Pure."""
