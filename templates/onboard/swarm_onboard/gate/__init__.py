"""The gate in front of a vendor's driver. Only ``ros`` knows ROS; all else runs and is tested without it."""
