#include <nav/Goal.h>
#include <ros/ros.h>

double planned();

int main(int argc, char **argv) {
  ros::init(argc, argv, "nav");
  ros::NodeHandle node;
  ros::Publisher out = node.advertise<nav::Goal>("goal", 1);
  nav::Goal goal;
  for (ros::Rate rate(10); ros::ok(); rate.sleep()) {
    goal.x = planned();
    out.publish(goal);
  }
}
