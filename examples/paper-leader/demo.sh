#!/usr/bin/env bash
# The example swarm, from nothing to robots that drive: boots three hosts in a lab of their own, deploys, drives, stops.
# `make demo` runs it, `make demo ROS=2` with the example of ROS 2. It needs root, because it boots real hosts in network
# namespaces; it leaves nothing behind.
set -euo pipefail
cd "$(dirname "$0")"
ros=${ROS:-1}
case $ros in
  1) spec=swarm.yaml ;;
  2) spec=../ros2-2-leader/swarm.yaml ;;
  *) echo "ROS is 1 or 2, not $ros" >&2; exit 1 ;;
esac
name=demo-$$
began=$SECONDS

say() { printf '\n\033[1m== %s\033[0m  (%d s)\n' "$*" $((SECONDS - began)); }
run() { printf '$ %s\n' "$*"; "$@"; }
on() { swarmctl lab shell "$spec" --name "$name" "$1" -- "source /opt/swarm/newswarm/current/setup.bash; $2"; }
publish() { on "$1" "timeout ${4:-3} rostopic pub -r 10 $2 geometry_msgs/Twist '$3' || true"; }
stranger() { # commands of somebody who may not, for 12 s
  if [ "$ros" = 1 ]; then
    publish epuck-pi /k3/cmd_vel '{linear: {x: 0.10}}' 10
  else
    on epuck-pi 'timeout 15 python3 -c "
import rclpy, time
from geometry_msgs.msg import Twist
rclpy.init()
node = rclpy.create_node(\"stranger\")
publisher = node.create_publisher(Twist, \"/k3/cmd_vel\", 1)
twist = Twist()
twist.linear.x = 0.1
while rclpy.ok():
    publisher.publish(twist)
    time.sleep(0.1)
" 2>/dev/null || true'
  fi
}
drive() { # every robot, for 3 s, with commands from the leader
  if [ "$ros" = 1 ]; then
    publish koala-laptop /k3/cmd_vel '{linear: {x: 0.10}, angular: {z: 0.5}}' &
    publish koala-laptop /epuck/cmd_vel '{linear: {x: 0.05}}' &
    publish koala-laptop /koala/cmd_vel '{linear: {x: 0.20}, angular: {z: -0.3}}' &
  else
    swarmctl lab shell "$spec" --name "$name" koala-laptop -- 'cat > gamepad.py' < ../gamepad.py
    on koala-laptop '(sleep 4; echo 0.5 0.2; sleep 3) | python3 gamepad.py' & # nodes find each other, the button is free
  fi
}
expect() { # expect CODE COMMAND...: run a command that must end with that exit code
  local wanted=$1 code=0
  shift
  run "$@" || code=$?
  [ "$code" = "$wanted" ] || { echo "expected exit code $wanted, got $code" >&2; exit 1; }
}
standing() { # whether every robot's wheels stand still
  swarmctl lab robots "$spec" --name "$name" --json | python3 -c '
import json, sys
robots = json.load(sys.stdin)["robots"]
moving = [name for name, robot in robots.items() if robot["left"] or robot["right"]]
sys.exit(", ".join(moving) + " still moves" if moving else 0)'
}

[ "$(id -u)" = 0 ] || { echo "the demo boots hosts in namespaces: run it as root" >&2; exit 1; }
trap 'swarmctl lab down --name "$name" 2>/dev/null' EXIT

say "Is the spec right?"
run swarmctl validate "$spec"

say "A lab: three Debian hosts with systemd, sshd and ROS $ros, three robots on serial lines"
run swarmctl lab up "$spec" --name "$name"

say "What would a deploy do? (exit code 2: there are changes)"
printf '$ swarmctl plan %s --lab-name %s --detailed-exitcode\n' "$spec" "$name"
expect 2 swarmctl plan "$spec" --lab-name "$name" --detailed-exitcode | tail -n 1

say "Deploy"
run swarmctl deploy "$spec" --lab-name "$name" --yes

say "Now there is nothing left to do (exit code 0)"
expect 0 swarmctl plan "$spec" --lab-name "$name" --detailed-exitcode

say "Is the swarm healthy?"
run swarmctl status "$spec" --lab-name "$name"

say "Where the robots are"
run swarmctl lab robots "$spec" --name "$name"

say "Commands from a host that does not lead: no robot obeys, and status names the sender"
stranger &
sleep $((ros * 2)) # s
standing
run swarmctl status "$spec" --lab-name "$name"
wait

say "Drive each robot for 3 s, with commands from the leader"
drive
sleep $((4 * ros - 2)) # s
run swarmctl lab robots "$spec" --name "$name"
wait

say "The commands have stopped, and so have the robots, 0.5 s later"
sleep 1
run swarmctl lab robots "$spec" --name "$name"
standing
say "Done: every robot drove and stands still"
