"""The swarm on one machine: real hosts in namespaces, emulated robots on ptys."""
