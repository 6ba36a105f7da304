"""The command line: one module a verb. A verb parses, calls its rooms and prints; it decides nothing."""
