"""The ROS 2 part of a release: environment, discovery, parameters, launch files, units."""
