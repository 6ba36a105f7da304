"""Rules: modes."""
