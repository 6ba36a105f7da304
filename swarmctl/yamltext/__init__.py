"""YAML text to positioned nodes, plain data and minimal edits. Knows no robots. Pure."""
