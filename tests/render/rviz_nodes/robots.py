"""What the drivers of a swarm publish: descriptions, odometry, joints, scans, frames of robots that stand."""

import json
import sys
from pathlib import Path

import rospy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage


class Robot:
    def __init__(self, given):
        self.odom_frame, self.base, self.joints = given["odom_frame"], given["base"], given["joints"]
        space = given["namespace"]
        if given["urdf"]:
            rospy.set_param(space + "/robot_description", Path(given["urdf"]).read_text("utf-8"))
        self.states = rospy.Publisher(space + "/joint_states", JointState, queue_size=1)
        self.topics = [
            (rospy.Publisher(space + "/" + name, kind, queue_size=1), kind)
            for name, kind in (("odom", Odometry), (given["scan"], LaserScan))
        ]

    def publish(self, stamp):
        states = JointState(name=self.joints, position=[0.0] * len(self.joints))
        states.header.stamp = stamp
        self.states.publish(states)
        for topic, kind in self.topics:
            message = kind()
            message.header.stamp = stamp
            message.header.frame_id = self.odom_frame if kind is Odometry else self.base
            if kind is Odometry:
                message.child_frame_id, message.pose.pose.orientation.w = self.base, 1.0
            else:
                message.angle_max, message.angle_increment, message.range_max = 2.0, 1.0, 2.0
                message.ranges = [1.0] * 3
            topic.publish(message)

    def transforms(self, stamp):
        return [transform("map", self.odom_frame, stamp), transform(self.odom_frame, self.base, stamp)]


def transform(parent, child, stamp):
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, stamp
    message.transform.rotation.w = 1.0
    return message


def main():
    rospy.init_node("drivers")
    robots = [Robot(one) for one in json.loads(Path(sys.argv[1]).read_text("utf-8"))]
    frames = rospy.Publisher("/tf", TFMessage, queue_size=10)
    print(json.dumps({"ready": True}), flush=True)
    while not rospy.is_shutdown():
        stamp = rospy.Time.now()
        frames.publish(TFMessage([each for robot in robots for each in robot.transforms(stamp)]))
        for robot in robots:
            robot.publish(stamp)
        rospy.sleep(0.1)


if __name__ == "__main__":
    main()
