"""Rules: unique identities."""
