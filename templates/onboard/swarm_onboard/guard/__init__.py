"""The guard of a ROS 1 master: which host may make which call. Needs no ROS library."""
