"""Joins islands of ROS 2: brings declared topics of other domains into the domain of its own island."""
