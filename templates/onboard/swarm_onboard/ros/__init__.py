"""What swarmctl's nodes need of ROS, whichever it is: `swarm_onboard.ros1` or `swarm_onboard.ros2` has it."""
