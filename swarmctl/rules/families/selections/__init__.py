"""Rules: selections."""
