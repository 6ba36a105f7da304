"""The graph of a swarm: one module an output."""
