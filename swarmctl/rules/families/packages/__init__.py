"""Rules: ROS packages and launch files that lie beside the spec."""
