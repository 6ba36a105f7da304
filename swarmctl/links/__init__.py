"""The kinds of links, one file for each: its keys in a spec, and all that other code asks of it."""
