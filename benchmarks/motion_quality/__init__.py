"""Ordered against driven: the driver's core and an emulated robot on one line, in virtual time."""
