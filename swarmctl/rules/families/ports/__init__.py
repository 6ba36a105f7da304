"""Rules: ports."""
