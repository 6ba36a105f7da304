"""Rules: topics."""
