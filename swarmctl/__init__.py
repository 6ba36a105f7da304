"""swarmctl: one YAML file describes a robot swarm; swarmctl checks, renders, deploys and watches it."""

from swarmctl import resources

__version__ = "0.1.0"

resources.make_robot_packages_importable()
