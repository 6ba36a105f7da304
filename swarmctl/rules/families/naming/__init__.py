"""Rules: ROS names."""
