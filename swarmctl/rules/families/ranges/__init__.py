"""Rules: ranges."""
