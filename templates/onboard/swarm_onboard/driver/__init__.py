"""The driver of a robot on a serial line. Only ``ros`` knows ROS; all else runs and is tested without it."""
