# sourced by ~/.bashrc on the laptop that rides on the Koala
source /opt/ros/noetic/setup.bash
export ROS_MASTER_URI=http://192.168.77.10:11311
export ROS_IP=192.168.77.10
