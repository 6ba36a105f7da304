"""Rules: the URDFs of robots."""
