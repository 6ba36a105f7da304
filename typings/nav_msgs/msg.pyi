from geometry_msgs.msg import PoseWithCovariance, TwistWithCovariance
from rospy import Message
from std_msgs.msg import Header

class Odometry(Message):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance
