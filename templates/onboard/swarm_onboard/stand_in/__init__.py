"""A stand-in for a robot with a driver of its vendor: takes commands, moves, publishes what is declared."""
