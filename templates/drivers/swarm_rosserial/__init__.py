"""The host's side of rosserial (version 2: hydro to noetic), byte for byte. Knows no port and no ROS."""
