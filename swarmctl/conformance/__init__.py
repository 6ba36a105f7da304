"""Tests one robot over its own line, with the same driver code that runs on a host."""
