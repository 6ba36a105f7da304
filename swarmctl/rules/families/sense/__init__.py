"""Rules: values that make no sense."""
