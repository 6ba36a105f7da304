"""As much of sensor_msgs as teleop touches."""
