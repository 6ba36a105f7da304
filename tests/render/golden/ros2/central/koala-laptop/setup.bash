# Written by swarmctl; the next deploy replaces it.
# For people:  source /opt/swarm/mixed/current/setup.bash
if [ -f /opt/ros/kilted/setup.bash ]; then
  . /opt/ros/kilted/setup.bash
fi
for folder in /home/robot/ws/install /home/robot/ws; do
  if [ -f "$folder/setup.bash" ]; then
    . "$folder/setup.bash"
    break
  fi
done
unset folder ROS_EASY_MODE ROS2_EASY_MODE ROS_AUTOMATIC_DISCOVERY_RANGE ROS_STATIC_PEERS ROS_LOCALHOST_ONLY FASTRTPS_DEFAULT_PROFILES_FILE CYCLONEDDS_URI ZENOH_ROUTER_CHECK_ATTEMPTS ZENOH_CONFIG_OVERRIDE ROS_SECURITY_ENABLE ROS_SECURITY_STRATEGY ROS_SECURITY_KEYSTORE ROS_SECURITY_ENCLAVE_OVERRIDE
export SWARM=mixed
export ROS_DOMAIN_ID=1
export RMW_IMPLEMENTATION=rmw_fastrtps_cpp
export ROS_DISCOVERY_SERVER='192.168.77.10:11811;192.168.77.11:11811'
export FASTDDS_DEFAULT_PROFILES_FILE=/opt/swarm/mixed/current/env/fastdds.xml
export ROS_SUPER_CLIENT=TRUE
