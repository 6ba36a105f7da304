"""The ROS 1 part of a release: environment, parameters, launch files, units."""
