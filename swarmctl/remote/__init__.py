"""Hosts over SSH: connections, pinned keys, the bounded parallel runner. Knows nothing of robots."""
