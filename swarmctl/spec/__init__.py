"""The swarm file: its models, loading, validation and defaults. Pure."""
