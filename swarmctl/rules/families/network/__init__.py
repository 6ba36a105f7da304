"""Rules: hosts and networks."""
