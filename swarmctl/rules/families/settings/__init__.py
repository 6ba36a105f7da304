"""Rules: robot settings."""
