"""What hosts, robots, programs, files and the choice of ROS mean together.

Most of these are places with other texts, in `mistakes_across.yaml`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from tests.mutations.defects import MISTAKES, Change, mistake, written
from tests.mutations.edits import changed_lines, edited, listed
from tests.mutations.places import File

MISTAKES |= listed(Path(__file__).with_suffix(".yaml"))


def _swap(first: str, second: str) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        one, other = ([*file.scalars(pattern)][:1] for pattern in (first, second))
        if one and other:
            yield from edited(
                file,
                ("/".join(map(str, one[0].loc)), str(other[0].value)),
                ("/".join(map(str, other[0].loc)), str(one[0].value)),
            )

    return changes


MISTAKES["two robots swapped between their hosts"] = _swap("robots.koala.host", "robots.k3.host")


def _overlay(text: str) -> Callable[[File], Iterator[Change]]:
    """A file that is laid over the spec, with one more part."""

    def changes(file: File) -> Iterator[Change]:
        if file.path.name == "fkie.yaml":
            number = file.text.count("\n") + 1
            yield Change(file.text + text + "\n", frozenset((number,)), f"line {number}")

    return changes


for _title, _text in {
    "the mode only": "mode: central",
    "a robot that is misspelt": "robots: {kaola: {optional: true}}",
    "a host removed that is used": "hosts: {k3-pi: ~}",
    "a robot removed that is commanded": "robots: {koala: ~}",
    "a key removed that is not there": "hub: ~",
    "a line of no robot": "links: [{robot: kaola, baud: 57600}]",
    "a network of another name": "links: [{name: lba, multicast: false}]",
    "a commander of nothing": "control: [{by: joystik, of: [koala]}]",
    "the commanded removed": "control: [{by: joystick, of: []}]",
    "another address": "hosts: {k3-pi: {address: 192.168.78.11}}",
    "another version": "version: 2",
    "another robot type": "robots: {koala: {type: turtlebot3-burger}}",
    "the spec itself": "include: swarm.yaml",
    "a program without its package": "programs: {gamepad: {package: ~}}",
    "ROS 2 for the same": "ros: {distro: jazzy}",
    "a leader in no such mode": "leader: koala-laptop",
}.items():  # fmt: skip
    MISTAKES[f"overlay: {_title}"] = _overlay(_text)


def _replaced(old: str, new: str) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        text = file.text.replace(old, new, 1)
        yield Change(text, changed_lines(file.text, text), old.strip())

    return changes


for _title, _old, _new in (
    ("include: a file twice", "include: [hosts.yaml,", "include: [hosts.yaml, hosts.yaml,"),
    ("include: itself", "include: [hosts.yaml,", "include: [swarm.yaml, hosts.yaml,"),
    ("include: outside the folder", "include: [hosts.yaml,", "include: [../hosts.yaml,"),
    ("include: a file that is not there", "include: [hosts.yaml,", "include: [host.yaml,"),
    ("include: a pattern", "include: [hosts.yaml,", 'include: ["*.yaml",'),
    ("include: a key of the spec again", "\nhosts:\n", "\nname: fleet\nhosts:\n"),
    ("range: shorter than the robots'", 'host: "cart-[13-36]"', 'host: "cart-[13-35]"'),
    ("range: counts down", '"cart-[13-36]": {', '"cart-[36-13]": {'),
    ("range: begins with one that is there", '"cart-[13-36]": {', '"cart-[12-36]": {'),
    ("range: addresses above 255", "[113-136]", "[233-256]"),
    ("range: addresses of others", "[113-136]", "[101-124]"),
    ("range: without its zeros", "epuck-[1-2]:", "epuck-[01-02]:"),
    ("range: two dots", "epuck-[1-2]:", "epuck-[1..2]:"),
    ("range: of adapters that end", '"CART[0013-0036]"', '"CART[0013-0035]"'),
    ("range: one adapter for all", '"CART[0013-0036]"', '"CART0013"'),
    (
        "control: a person below a program",
        "priority: 10}\n  - {by: planner",
        "priority: 1}\n  - {by: planner",
    ),
    ("control: a priority twice", "priority: 5}", "priority: 10}"),
    ("selection: of no robot", '"@rovers"', '"zz-*"'),
    ("selection: a group that is not there", '"@rovers"', '"@rover"'),
    ("selection: a type that is not there", '"type:epuck2"', '"type:epuk2"'),
    ("selection: everything taken away", '"!uav"]', '"!*"]'),
    ("selection: takes away a robot that is not there", '"!uav"', '"!uavs"'),
    ("selection: a prefix that is not there", '"type:epuck2"', '"kind:epuck2"'),
    ("selection: an island without islands", '"type:epuck2"', '"island:east"'),
):
    mistake(_title)(_replaced(_old, _new))


@mistake("two lines with their robots exchanged")
def _crossed_lines(file: File) -> Iterator[Change]:
    lines = [one for one in file.scalars("links.*.robot") if one.value and "[" not in one.value]
    if len(lines) > 1:
        first, other = (f"links/{one.loc[1]}/robot" for one in lines[:2])
        yield from edited(file, (first, lines[1].value), (other, lines[0].value))


@mistake("commands rarer than the dead-man")
def _rare_commands(file: File) -> Iterator[Change]:
    for topic in file.scalars("programs.*.publishes.*.topic"):
        if str(topic.value).endswith("cmd_vel"):
            rate = next(one for one in file.scalars() if one.loc == (*topic.loc[:-1], "rate"))
            yield written(file, rate, "1.0")
