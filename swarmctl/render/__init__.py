"""From the resolved swarm to the exact bytes each host gets. Pure and deterministic."""
