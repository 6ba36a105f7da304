export ROS_HOSTNAME=k3.local
export ROS_MASTER_URI=http://k3.local:11311/
