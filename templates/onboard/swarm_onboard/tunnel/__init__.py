"""The WireGuard interface of a host. Needs no ROS library."""
