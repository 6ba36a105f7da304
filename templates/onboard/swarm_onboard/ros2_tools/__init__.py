"""Tools for the graph of ROS 2, by rclpy, that come to a host with the command that runs them."""
