"""Runs the rules over the spec and its graph; what they read, fixes, and ignored findings."""
