"""Rules: microcontroller boards."""
