"""The rules: one folder a family, with the functions that find and `rules.yaml` that explains."""
