# Written by swarmctl; the next deploy replaces it.
# For people:  source /opt/swarm/newswarm/current/setup.bash
extend=
if [ -z "$extend" ] && [ -f /opt/ros/noetic/setup.bash ]; then
  . /opt/ros/noetic/setup.bash
fi
unset folder extend
export SWARM=newswarm
export ROS_MASTER_URI=http://192.168.77.10:11311
unset ROS_IP ROS_HOSTNAME ROS_IPV6
export ROS_IP=192.168.77.12
export ROS_PACKAGE_PATH=/opt/swarm/newswarm/current/drivers:"${ROS_PACKAGE_PATH:-/usr/share:/usr/lib}"
