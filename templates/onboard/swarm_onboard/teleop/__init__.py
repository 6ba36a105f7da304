"""Joystick and keyboard that command robots. Only ``ros`` knows ROS; the rest is tested without it."""
