"""Who may command a robot, and for how long: what its driver and the gate share. Only ``ros`` knows ROS."""
