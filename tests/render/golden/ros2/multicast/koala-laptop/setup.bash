# Written by swarmctl; the next deploy replaces it.
# For people:  source /opt/swarm/mixed/current/setup.bash
if [ -f /opt/ros/kilted/setup.bash ]; then
  . /opt/ros/kilted/setup.bash
fi
unset folder ROS_DISCOVERY_SERVER ROS_SUPER_CLIENT ROS_EASY_MODE ROS2_EASY_MODE ROS_STATIC_PEERS ROS_LOCALHOST_ONLY FASTRTPS_DEFAULT_PROFILES_FILE CYCLONEDDS_URI ZENOH_ROUTER_CHECK_ATTEMPTS ZENOH_CONFIG_OVERRIDE ROS_SECURITY_ENABLE ROS_SECURITY_STRATEGY ROS_SECURITY_KEYSTORE ROS_SECURITY_ENCLAVE_OVERRIDE
export SWARM=mixed
export ROS_DOMAIN_ID=1
export RMW_IMPLEMENTATION=rmw_fastrtps_cpp
export ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET
export FASTDDS_DEFAULT_PROFILES_FILE=/opt/swarm/mixed/current/env/fastdds.xml
