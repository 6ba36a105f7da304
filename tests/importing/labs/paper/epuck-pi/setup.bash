export ROS_MASTER_URI=http://192.168.77.10:11311
export ROS_IP=$(hostname -I | cut -d' ' -f1)
export ROS_HOSTNAME=epuck-pi
