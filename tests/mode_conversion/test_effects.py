"""The notes of a conversion: masters, programs, commanders, islands and comments that change."""

from __future__ import annotations

from swarmctl.diagnostics import has_errors
from swarmctl.linter.runner import lint
from swarmctl.mode_conversion.convert import Conversion, converted
from swarmctl.mode_conversion.infer import infer
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import Document, load_text
from swarmctl.spec.model import Mode
from swarmctl.swarm.index import SwarmIndex

TEXT = """version: 1
name: odd
mode: central
hub: laptop   # the desk
hosts:
  gate: {address: 192.168.9.9}
  pi: {address: 10.0.0.2, computer: laptop, via: gate, has: [joystick]}
  laptop: {address: 10.0.0.1, computer: laptop, has: [joystick]}
robots:
  koala: {type: koala, host: laptop}
  k3: {type: khepera3, host: pi}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi], multicast: true}
  - {kind: serial, host: laptop, robot: koala, usb: {serial: A1}}
  - {kind: serial, host: pi, robot: k3, usb: {serial: A2}}
"""
JOYSTICK = "programs:\n  joy: {needs: [joystick], use: teleop-joy}\ncontrol:\n  - {by: joy, of: [k3]}\n"
ISLANDS = """islands:
  west: {mode: central, hub: laptop, hosts: [laptop]}   # by the window
  east: {mode: central, hub: pi, hosts: [pi]}
"""


def read(text: str) -> Document:
    document, found = load_text(text, "swarm.yaml", load_catalog())
    assert document is not None, found
    assert not has_errors(lint(document)), lint(document)
    return document


def conversion(text: str, mode: Mode) -> Conversion:
    made = converted(read(text), mode)
    read(made.text)
    return made


def test_who_gains_and_who_loses_command_is_noted() -> None:
    notes = conversion(TEXT, Mode.LEADER).notes
    assert "`laptop` may command `koala`, `k3`" in notes
    assert "the own programs of `koala`, `k3` may no longer command their robots" in notes
    back = conversion(TEXT.replace("mode: central\nhub", "mode: leader\nleader"), Mode.CENTRAL).notes
    assert "the own programs of `koala`, `k3` may command their robots" in back


def test_a_program_on_another_host_is_noted() -> None:
    notes = conversion(TEXT + JOYSTICK, Mode.SINGLE_MINDED).notes
    assert "program `joy` runs on `laptop` instead of `pi`" in notes
    camera = "programs:\n  camera: {host: pi, needs: [kinect], package: p, executable: e}\n"
    text = TEXT.replace("has: [joystick]", "has: [kinect]", 1) + camera
    notes = conversion(text, Mode.SINGLE_MINDED).notes
    assert "program `camera` runs on `laptop` instead of `pi`, which has no `kinect`" in notes


def test_a_master_on_another_host_is_noted() -> None:
    notes = conversion(TEXT + JOYSTICK, Mode.LEADER).notes
    assert "the master runs on `pi` instead of `laptop`" in notes


def test_islands_and_comments_that_go_are_noted() -> None:
    text = TEXT.replace("mode: central\nhub: laptop   # the desk\n", "mode: combined\n") + ISLANDS
    notes = conversion(text, Mode.CENTRAL).notes
    assert "converting back does not restore the islands `west`, `east`" in notes
    assert "swarm.yaml:16: the comment of a removed key is gone: # by the window" in notes


def test_a_conversion_to_the_same_mode_has_no_notes() -> None:
    assert conversion(TEXT, Mode.CENTRAL).notes == ()


def test_a_jump_host_joins_no_island_and_drives_nothing() -> None:
    islands = read(conversion(TEXT, Mode.COMBINED).text).spec.islands
    assert [island.hosts for island in islands.values()] == [("laptop",), ("pi",)]
    robots = "".join(f"  r{n}: {{type: khepera3}}\n" for n in range(4))
    lines = "".join(
        f"  - {{kind: serial, host: laptop, robot: r{n}, usb: {{serial: S{n}}}}}\n" for n in range(4)
    )
    text = TEXT.replace("mode: central\nhub", "mode: single-minded\nleader").replace(
        "host: pi,", "host: laptop,"
    )
    text = text.replace(", host: pi}", "}").replace(", host: laptop}", "}")
    text = text.replace("links:\n", f"{robots}links:\n") + lines
    hosts = {robot.host for robot in read(conversion(text, Mode.CENTRAL).text).spec.robots.values()}
    assert hosts == {"laptop", "pi"}


def test_one_central_island_is_not_called_a_leaders() -> None:
    text = TEXT.replace("mode: central\nhub: laptop   # the desk\n", "mode: combined\n")
    one = "islands:\n  all: {mode: central, hub: laptop, hosts: [laptop, pi]}\n"
    found = infer(SwarmIndex(read(text + one)))
    assert found.mode is Mode.CENTRAL
    assert not any("leader" in reason for reason in found.because)
