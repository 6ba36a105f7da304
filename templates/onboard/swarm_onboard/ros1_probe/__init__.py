"""How the agent observes a ROS 1 graph for ``swarmctl status``: part of the agent, Python 3.8, no ROS."""
