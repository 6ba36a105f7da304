"""What can be asked of a host: one module a verb."""
