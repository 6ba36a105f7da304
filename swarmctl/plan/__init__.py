"""Desired bundles against observed hosts: an ordered list of steps, each with its cause. Pure."""
