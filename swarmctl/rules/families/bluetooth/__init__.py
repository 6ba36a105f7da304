"""Rules: Bluetooth adapters."""
