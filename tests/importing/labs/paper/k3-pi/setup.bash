export ROS_MASTER_URI="http://192.168.77.10:11311"
export ROS_IP="192.168.77.11"   # fixed in the router
