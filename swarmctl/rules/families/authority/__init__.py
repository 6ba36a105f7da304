"""Rules: command authority."""
