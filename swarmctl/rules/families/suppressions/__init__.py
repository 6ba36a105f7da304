"""Rules: suppressions."""
