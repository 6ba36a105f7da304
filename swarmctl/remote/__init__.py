"""Hosts over SSH: connections, pinned keys, the bounded parallel runner. Independent of robots."""
