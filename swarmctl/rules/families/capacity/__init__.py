"""Rules: host and network load."""
