"""The host's side of rosserial (protocol version 2: hydro to noetic). Uses no port and no ROS."""
