"""Faults of a lab, made on purpose: each kind begins at a host or a robot, and can be ended at any time."""
