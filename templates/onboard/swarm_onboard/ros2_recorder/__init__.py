"""Records topics of ROS 2 in MCAP files (mcap.dev), in a unit that the agent starts."""
