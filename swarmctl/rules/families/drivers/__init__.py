"""Rules: ROS packages as drivers."""
