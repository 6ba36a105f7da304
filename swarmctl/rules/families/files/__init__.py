"""Rules: files and syntax."""
