"""The health of a swarm: the expected graph, what the hosts report, and the causes of the differences."""
