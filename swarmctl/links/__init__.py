"""The kinds of links: the keys of each in a spec, and all that other code asks of it."""
