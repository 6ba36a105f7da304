"""How the agent observes a ROS 2 graph for ``swarmctl status``: Python 3.8; a child process has rclpy."""
