"""The swarm on one machine: hosts in namespaces, emulated robots on ptys."""
