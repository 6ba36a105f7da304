"""``swarmctl record`` on real hosts: bags of the hosts that publish, over lost links and a full disk."""

from __future__ import annotations

import hashlib
import signal
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from tests.e2e.bags import FOLDER, ended, forget, is_recording, messages
from tests.e2e.lab_swarm import LabSwarm
from tests.timing import wait_for


@pytest.fixture(autouse=True)
def _clean(swarm: LabSwarm) -> Iterator[None]:
    yield
    forget(swarm)


def test_each_topic_is_in_the_bag_of_its_host(swarm: LabSwarm, tmp_path: Path) -> None:
    recording = swarm.begin("record", "--out", str(tmp_path), "--json")
    for host in swarm.hosts:
        wait_for(partial(is_recording, swarm, host), interval=0.2)
    swarm.cut("epuck-pi")
    with swarm.driving("koala-laptop", "k3", 0.05):
        time.sleep(2)
    swarm.join("epuck-pi")
    echo = "rostopic echo -n 1 /epuck/odom/header/seq"
    after = swarm.shell("epuck-pi", f"bash -c '. /opt/swarm/newswarm/current/setup.bash; {echo}'")
    recording.send_signal(signal.SIGINT)
    status, hosts = ended(recording)
    assert status == exit_codes.OK, hosts
    bags = {host: [Path(bag) for bag in one["bags"]] for host, one in hosts.items()}
    recorded = {host: {one[0] for bag in bags[host] for one in messages(bag)} for host in bags}
    for robot, host in (("k3", "k3-pi"), ("epuck", "epuck-pi"), ("koala", "koala-laptop")):
        assert [one for one, topics in recorded.items() if f"/{robot}/odom" in topics] == [host]
    assert "/tf" in recorded["koala-laptop"], "the hub has what several hosts publish"
    commands = [one for bag in bags["k3-pi"] for one in messages(bag, "/k3/cmd_vel")]
    assert {message.linear.x for _, _, message in commands} == {0.05}
    numbers = [one.header.seq for bag in bags["epuck-pi"] for _, _, one in messages(bag, "/epuck/odom")]
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "a lost link leaves no gap"
    assert int(after.split()[0]) in numbers
    assert set(swarm.everywhere(f"ls {FOLDER}").values()) == {""}, "the hosts have their space back"


def test_a_disk_that_is_nearly_full_ends_a_recording_cleanly(swarm: LabSwarm, tmp_path: Path) -> None:
    swarm.shell("k3-pi", f"sudo mkdir -p {FOLDER} && sudo mount -t tmpfs -o size=64M bags {FOLDER}")
    try:
        recording = swarm.begin("record", "/k3/*", "--limit", "k3-pi", "--out", str(tmp_path), "--json")
        wait_for(lambda: is_recording(swarm, "k3-pi"), interval=0.2)
        swarm.shell("k3-pi", f"sudo fallocate -l 60M {FOLDER}/filler")
        status, hosts = ended(recording)
        assert swarm.shell("k3-pi", f"ls {FOLDER}").split() == ["filler"]
    finally:
        swarm.shell("k3-pi", f"sudo umount {FOLDER}")
    assert (status, hosts["k3-pi"]["ended"]) == (exit_codes.OK, "disk")
    (bag,) = hosts["k3-pi"]["bags"]
    assert messages(Path(bag), "/k3/odom"), "the bag was closed"


def test_bags_survive_their_operator_and_a_lost_link(swarm: LabSwarm, tmp_path: Path) -> None:
    here = ("--limit", "k3-pi", "--out", str(tmp_path), "--json")
    recording = swarm.begin("record", "/k3/odom", *here)
    wait_for(lambda: is_recording(swarm, "k3-pi"), interval=0.2)
    recording.kill()
    recording.communicate()
    again = swarm.swarmctl("record", "/k3/odom", *here)
    assert again.status == exit_codes.HOSTS_FAILED
    assert "a recording runs here since" in again.err
    assert "--fetch` ends it" in again.err
    large = f"{FOLDER}/large_0.bag"
    digest = swarm.shell("k3-pi", f"head -c 300M /dev/urandom > {large}; sha256sum < {large}").split()[0]
    fetching = swarm.begin("record", "--fetch", *here)
    wait_for(lambda: [one for one in tmp_path.glob(".large*.part") if one.stat().st_size])
    swarm.cut("k3-pi")
    try:
        assert fetching.stderr is not None
        assert "not connected" in fetching.stderr.readline()
        (part,) = tmp_path.glob(".large*.part")
    finally:
        swarm.join("k3-pi")
    status, hosts = ended(fetching)
    assert status == exit_codes.OK, hosts
    bags = {Path(bag).name.partition("_")[0]: Path(bag) for bag in hosts["k3-pi"]["bags"]}
    with bags["large"].open("rb") as file:
        assert hashlib.sha256(file.read()).hexdigest() == digest
    assert messages(bags["k3-pi"], "/k3/odom")
    assert not part.exists()
