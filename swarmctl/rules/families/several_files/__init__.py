"""Rules: specs in several files."""
