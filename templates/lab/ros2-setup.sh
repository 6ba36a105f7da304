# Puts ROS 2 first in the search paths, as ROS's own setup files do; bash and sh can source it, also twice.
_ros_first() {
  eval "_ros_before=\${$1-}"
  case ":$_ros_before:" in
    *":$2:"*) ;;
    *) eval "export $1=\"\$2\${_ros_before:+:\$_ros_before}\"" ;;
  esac
}
export ROS_VERSION=2
export ROS_PYTHON_VERSION=3
export ROS_DISTRO=@DISTRO@
_ros_first AMENT_PREFIX_PATH @PREFIX@
_ros_first PATH @PREFIX@/bin
_ros_first PYTHONPATH @PREFIX@/@SITE@
_ros_first LD_LIBRARY_PATH @PREFIX@/lib
unset _ros_before
unset -f _ros_first
