"""``swarmctl record`` on hosts with ROS 2: filtered, and with discovery servers."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.swarm.topic_island import motion_topics
from swarmctl.ui import bags
from tests.e2e.bags import FOLDER, ended, forget, is_recording, messages
from tests.e2e.lab_needs import skip_without_wheels
from tests.e2e.lab_swarm import SWARM, LabSwarm, lab_of, quoted
from tests.loading import load_swarm
from tests.timing import wait_for

DESK, PI = "desk", "rover"  # no names of the shared lab, whose connections go by them
SPEC = f"""\
version: 1
name: {SWARM}
mode: central
hub: {DESK}
security: filtered
ros: {{distro: jazzy, servers: [{DESK}, {PI}]}}
hosts:
  {DESK}: {{address: 192.168.77.10, user: robot}}
  {PI}: {{address: 192.168.77.11, user: robot}}
robots:
  koala: {{type: koala, host: {DESK}}}
  k3: {{type: khepera3, host: {PI}}}
links:
  - {{kind: wlan, name: lab, hosts: [{DESK}, {PI}], multicast: false}}
  - {{kind: serial, host: {DESK}, robot: koala, usb: {{serial: A600dXyz}}, baud: 115200}}
  - {{kind: serial, host: {PI}, robot: k3, usb: {{serial: FTDI1234}}}}
"""
#: A node that the spec does not have.
PUBLISHES = """
import sys, time, rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node(sys.argv[1])
publishers = [node.create_publisher(String, one, 10) for one in sys.argv[2:]]
open(f"/tmp/{sys.argv[1]}", "w").close()
while True:
    for one in publishers:
        one.publish(String(data=sys.argv[1]))
    time.sleep(0.1)
"""


@pytest.fixture(scope="module")
def pair(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "record.yaml"
    spec.write_text(SPEC)
    skip_without_wheels(spec)
    with lab_of(f"record-{os.getpid()}", spec, workplace) as found:
        run = found.deploy()
        assert run.status == exit_codes.OK, run.out + run.err
        yield found
        forget(found)


def test_each_topic_is_in_the_file_of_its_host(pair: LabSwarm, tmp_path: Path) -> None:
    swarm, _ = load_swarm(pair.spec)
    assert swarm is not None
    with ExitStack() as publishing:
        for host, node in ((DESK, "here"), (PI, "there")):
            words = " ".join(map(quoted, (PUBLISHES, node, f"/{node}/name", "/names")))
            publishing.enter_context(pair.running(host, f"python3 -uc {words}"))
            wait_for(partial(pair.shell, host, f"ls /tmp | grep -x {node} || true"), interval=0.2)
        recording = pair.begin("record", "--out", str(tmp_path), "--json")
        for host in (DESK, PI):
            wait_for(partial(is_recording, pair, host), interval=0.2)
        status = pair.swarmctl("status", "--json").json()
        recording.send_signal(signal.SIGINT)
        status_code, hosts = ended(recording)
    assert status_code == exit_codes.OK, hosts
    assert {one["ended"] for one in hosts.values()} == {"stopped"}
    files = {host: [Path(one) for one in found["bags"]] for host, found in hosts.items()}
    found = {host: [one for file in files[host] for one in messages(file)] for host in (DESK, PI)}
    recorded = {host: {topic for topic, _, _ in found[host]} for host in found}
    assert not recorded[DESK] & recorded[PI], "nothing is recorded twice"
    assert {"/koala/odom", "/here/name", "/names", "/tf"} <= recorded[DESK]
    assert {"/k3/odom", "/there/name"} <= recorded[PI]
    assert {one.data for topic, _, one in found[DESK] if topic == "/names"} == {"here", "there"}
    assert [one for one in status["findings"] if "_swarm_recording" in str(one)] == []
    for robot, host in (("koala", DESK), ("k3", PI)):
        stamps = [one.header.stamp for topic, _, one in found[host] if topic == f"/{robot}/odom"]
        times = [one.sec + one.nanosec / 1e9 for one in stamps]
        assert all(one < two for one, two in pairwise(times)), "no message is there twice"
        (rate,) = (one.rate for one in swarm.robots[robot].topics if one.name == "odom")
        assert len(times) == pytest.approx((times[-1] - times[0]) * rate, rel=0.5)
    shown = bags.read(tmp_path, motion_topics(swarm))
    assert (shown.troubles, shown.rows.keys()) == ([], {"koala", "k3"})
    assert all(row[1] is not None for rows in shown.rows.values() for row in rows)
    assert set(pair.everywhere(f"ls {FOLDER}").values()) == {""}, "the hosts have their space back"


def test_what_a_killed_recorder_leaves_is_brought_and_named(pair: LabSwarm, tmp_path: Path) -> None:
    here = ("--limit", PI, "--out", str(tmp_path))
    recording = pair.begin("record", "/k3/odom", *here)
    wait_for(partial(is_recording, pair, PI), interval=0.2)
    pair.shell(PI, f"sudo systemctl kill -s KILL swarm-recording@{SWARM}")
    out, err = recording.communicate()
    assert recording.returncode == exit_codes.OK, err
    (left,) = tmp_path.iterdir()
    assert left.name.endswith("_0.mcap.active")
    assert "until the recorder was gone" in out
    assert f"it was not closed; `mcap recover {left.name} -o {left.stem}` repairs it" in " ".join(out.split())
