from collections.abc import Sequence

from geometry_msgs.msg import TransformStamped
from rospy import Message

class TFMessage(Message):
    transforms: Sequence[TransformStamped]
    def __init__(self, transforms: Sequence[TransformStamped] = ...) -> None: ...
