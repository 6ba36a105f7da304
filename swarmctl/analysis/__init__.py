"""Graph algorithms and load budgets over a swarm: dependencies, impact, command paths. Pure."""
