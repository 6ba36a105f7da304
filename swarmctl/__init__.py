"""swarmctl: one YAML file describes a robot swarm; swarmctl checks, renders, deploys and watches it."""

__version__ = "0.1.0"
