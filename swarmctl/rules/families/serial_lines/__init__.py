"""Rules: load of serial and Bluetooth links."""
