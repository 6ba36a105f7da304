"""From a sketch's source to a board: compiling, measuring. Knows nothing of specs or swarms."""
