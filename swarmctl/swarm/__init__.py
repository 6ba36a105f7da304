"""The swarm as a graph: modes applied, islands and hubs found, drivers placed, names given. Pure."""
