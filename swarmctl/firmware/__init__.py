"""Compiles a sketch, measures it, and makes the command that writes it. Independent of specs."""
