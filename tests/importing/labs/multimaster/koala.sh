export ROS_HOSTNAME=koala.local
export ROS_MASTER_URI=http://koala.local:11311/
