"""One module a verb: it parses, calls and prints; it decides nothing."""
