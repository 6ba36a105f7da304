export ROS_HOSTNAME=epuck.local
export ROS_MASTER_URI=http://epuck.local:11311/
