"""As much of geometry_msgs as teleop touches."""
