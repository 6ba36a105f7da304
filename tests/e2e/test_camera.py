"""The camera of an e-puck while it drives: images come whole, and none of them holds up the dead-man."""

from __future__ import annotations

import json
import os
import shutil
import signal
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.e2e import slow_epuck
from tests.e2e.dead_man import Commander, Watch, commanding
from tests.e2e.lab_swarm import (
    SOURCE,
    LabSwarm,
    lab_of,
    moves,
    quoted,
    until,
)
from tests.timing import Promise

HOST, ROBOT = "pi", "ep"
WIDTH, HEIGHT = 50, 44  # an image of 0.43 s; the robot's own are smaller, and in colour
SPEC = f"""\
version: 1
name: newswarm
mode: leader
leader: {HOST}
hosts: {{{HOST}: {{address: 192.168.77.10}}}}
robots:
  {ROBOT}:
    type: epuck-binary
    host: {HOST}
    settings:
      rates: {{camera: 1, odom: 4, proximity: 4, accelerometer: 4}}
      camera: {{width: {WIDTH}, height: {HEIGHT}}}
links: [{{kind: serial, host: {HOST}, robot: {ROBOT}, usb: {{serial: EPUCK1}}}}]
control: [{{by: {HOST}, of: [{ROBOT}]}}]
"""
LISTEN = """\
import json, sys, time
import rospy
from nav_msgs.msg import Odometry
from sensor_msgs.msg import Image

PARTS = ("width", "height", "encoding", "is_bigendian", "step")
images, poses = [], []
rospy.init_node("listener")
topics = [
    rospy.Subscriber("camera/image_raw", Image, lambda image: images.append((time.monotonic(), image))),
    rospy.Subscriber("odom", Odometry, lambda pose: poses.append(time.monotonic())),
]
time.sleep(float(sys.argv[1]))
print(json.dumps({
    "images": [{**{part: getattr(one, part) for part in PARTS}, "data": list(one.data)} for _, one in images],
    "camera": [at for at, _ in images],
    "odom": poses,
}))
"""
SPEED = 0.05  # m/s
LISTENED_S = 4.0  # s
MOMENTS = {  # s after an image was begun, and whether it is still on its way then
    "an image begins": (0.0, True),
    "half of it is sent": (0.2, True),
    "the next is due 0.4 s later": (0.6, False),
}
BOUND = 0.75  # s; 0.5 is command_timeout, and behind an image that was begun too late it would be 0.8


@pytest.fixture(scope="module")
def swarm(workplace: Path) -> Iterator[LabSwarm]:
    folder = workplace / "camera"
    (folder / "robots").mkdir(parents=True)
    shutil.copy(slow_epuck.__file__, folder / "robots/epuck-binary.emulator.py")
    spec = folder / "swarm.yaml"
    spec.write_text(SPEC)
    with lab_of(f"camera-{os.getpid()}", spec, folder) as swarm:
        deploy = swarm.deploy()
        assert deploy.status == 0, deploy.out + deploy.err
        yield swarm


@pytest.fixture(scope="module")
def watch(swarm: LabSwarm) -> Iterator[Watch]:
    with Watch(swarm.name) as watch:
        yield watch


@pytest.fixture
def commander(swarm: LabSwarm) -> Iterator[Commander]:
    with commanding(swarm, HOST, {ROBOT: SPEED}) as commander:
        commander.command(1.0)
        until(lambda: moves(swarm.robot(ROBOT)), "it does not move")
        yield commander


def test_images_come_whole_and_in_time_while_it_drives(
    swarm: LabSwarm, commander: Commander, promise: Promise
) -> None:
    received = listened(swarm)
    promise("images of a robot that drives, one each", period(received["camera"]), 1 / 0.8)
    promise("its odometry between them, one each", period(received["odom"]), 1 / 3.2)
    until(lambda: is_healthy_and_drives(swarm), lambda: swarm.swarmctl("status").out)


def is_healthy_and_drives(swarm: LabSwarm) -> bool:
    status = swarm.swarmctl("status")
    return status.status == 0 and "driving" in status.out and "camera comes at" not in status.out


def listened(swarm: LabSwarm) -> dict[str, Any]:
    """The images and the moments of odometry within some s of a drive; each image is whole."""
    place = swarm.robot(ROBOT)["distance"]
    listen = f"{SOURCE}; ROS_NAMESPACE={ROBOT} python3 -c {quoted(LISTEN)} {LISTENED_S:g}"
    received: dict[str, Any] = json.loads(swarm.shell(HOST, listen))
    assert swarm.robot(ROBOT)["distance"] - place > 0.95 * SPEED * LISTENED_S
    for image in received["images"]:
        first = image["data"][0]
        pixels = [(first + index) & 0xFF for index in range(WIDTH * HEIGHT)]
        parts = {"width": WIDTH, "height": HEIGHT, "encoding": "mono8", "is_bigendian": 0, "step": WIDTH}
        assert image == {**parts, "data": pixels}
    assert len({image["data"][0] for image in received["images"]}) > 1, "it is the same image each time"
    return received


def period(stamps: Sequence[float]) -> float:
    return (stamps[-1] - stamps[0]) / (len(stamps) - 1)


@pytest.mark.parametrize("moment", MOMENTS)
def test_no_image_holds_up_the_dead_man(
    moment: str, swarm: LabSwarm, watch: Watch, commander: Commander, promise: Promise
) -> None:
    after, sending = MOMENTS[moment]

    def has_come() -> bool:
        until(lambda: not has_image_to_send(swarm), "an image does not end")
        until(lambda: has_image_to_send(swarm), "no image is begun")
        time.sleep(after)
        return has_image_to_send(swarm) is sending

    until(has_come, "the moment does not come")
    killed = commander.send(signal.SIGKILL)
    stop = watch.stops(killed)[ROBOT]
    promise(f"publisher killed as {moment}, until it stands", stop.seconds - stop.withheld, BOUND)


def has_image_to_send(swarm: LabSwarm) -> bool:
    """While it sends one it takes up no other request."""
    return bool(swarm.robot(ROBOT)["last_command"] == slow_epuck.IMAGE)
