"""Rules: safety."""
