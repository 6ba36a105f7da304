"""Texts of files that swarmctl writes into a user's folder: a first spec, a robot type. Pure."""
