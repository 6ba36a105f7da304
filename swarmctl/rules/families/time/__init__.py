"""Rules: time synchronisation."""
