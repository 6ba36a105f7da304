"""Rules: serial and Bluetooth links."""
