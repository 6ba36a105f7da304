"""``swarmctl logs`` on real hosts: merged in the order of time, and complete over a lost link."""

from __future__ import annotations

import json
import os
import signal
import threading
from collections import defaultdict
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from tests.e2e.lab_swarm import LabSwarm, lab_of
from tests.timing import PATIENCE, wait_for

SPEC = """\
version: 1
name: newswarm
mode: leader
leader: laptop
hosts:
  laptop: {address: 192.168.77.10}
  pi: {address: 192.168.77.11, computer: raspberry-pi-2b}
robots:
  rover: {type: arduino-rover, host: pi}
programs:
  here: {host: laptop, command: &count [sh, -c, "n=0; while sleep 0.1; do n=$((n+1)); echo n $n; done"]}
  there: {host: pi, command: *count}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: rover, usb: {serial: "85430353531351B02152"}}
control: [{by: laptop, of: [rover]}]
"""


@pytest.fixture(scope="module")
def two(workplace: Path) -> Iterator[LabSwarm]:
    spec = workplace / "two.yaml"
    spec.write_text(SPEC)
    (workplace / "logs").mkdir()
    with lab_of(f"e2e-logs-{os.getpid()}", spec, workplace / "logs") as swarm:
        done = swarm.deploy()
        assert done.status == 0, done.out + done.err
        yield swarm


def counted(entries: list[dict[str, Any]]) -> Mapping[str, list[int]]:
    """The numbers that each program has printed."""
    found = defaultdict(list)
    for entry in entries:
        if entry["message"].startswith("n "):
            found[entry["source"]].append(int(entry["message"][2:]))
    return found


def test_the_logs_of_two_hosts_are_one_in_the_order_of_time(two: LabSwarm) -> None:
    wait_for(lambda: len(counted(entries(two)).get("there", [])) > 10, interval=0.5)
    shown = entries(two, "--grep", "^n ")
    assert [one["time"] for one in shown] == sorted(one["time"] for one in shown)
    turns = sum(one["host"] != other["host"] for one, other in pairwise(shown))
    assert turns > len(shown) / 4, "their lines alternate"
    assert {one["source"] for one in entries(two, selection="rover")} == {"rover"}
    assert {one["source"] for one in entries(two, "--since", "1m", selection="program:there")} == {"there"}
    assert len(entries(two, "-n", "3", selection="pi")) == 3


def entries(two: LabSwarm, *options: str, selection: str = "*") -> list[dict[str, Any]]:
    done = two.swarmctl("logs", selection, "--json", *options)
    assert done.status == 0, done.err
    return [json.loads(line) for line in done.out.splitlines()]


class Following:
    """``swarmctl logs --follow``, and what it has printed."""

    def __init__(self, two: LabSwarm) -> None:
        self.process = two.begin("logs", "--follow", "-n", "1", "--json")
        self.entries: list[dict[str, Any]] = []
        self.messages: list[str] = []
        for stream, take in ((self.process.stdout, self._entry), (self.process.stderr, self.messages.append)):
            threading.Thread(target=lambda stream=stream, take=take: [take(one) for one in stream]).start()

    def _entry(self, line: str) -> None:
        self.entries.append(json.loads(line))

    def numbers(self, source: str) -> list[int]:
        return counted(list(self.entries)).get(source, [])

    def reported(self, text: str) -> bool:
        return any(text in one for one in self.messages)


def test_following_goes_on_after_a_cut_without_loss_or_doubles(two: LabSwarm) -> None:
    following = Following(two)
    try:
        wait_for(lambda: len(following.numbers("there")) > 5 and len(following.numbers("here")) > 5)
        two.cut("pi")
        try:
            wait_for(lambda: following.reported("pi  "), complaint="the lost link is not reported")
            before = len(following.numbers("here"))
            wait_for(
                lambda: len(following.numbers("here")) > before + 5, complaint="one host holds up others"
            )
        finally:
            two.join("pi")
        wait_for(lambda: following.reported("pi  connected again"))
        last = following.numbers("there")[-1]
        wait_for(lambda: following.numbers("there")[-1] > last + 50)
    finally:
        following.process.send_signal(signal.SIGINT)
        status = following.process.wait(PATIENCE)
    assert status == 0
    numbers = following.numbers("there")
    assert numbers == list(range(numbers[0], numbers[0] + len(numbers))), "in order, none lost, none double"
    for host in two.hosts:
        wait_for(lambda host=host: not followers(two, host), complaint=f"journalctl stays on {host}")


def followers(two: LabSwarm, host: str) -> str:
    return two.shell(host, "pgrep -x journalctl || true").strip()
