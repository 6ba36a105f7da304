"""The capsule of a trial: one folder with all of it, and an index that proves that nothing changed."""
