"""Every check of `driver test` passes on a board that is as its type says, and fails on one that is not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import pytest
import swarm_onboard.driver.rosserial_robot
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.dead_man import DeadMan

from swarmctl.conformance.bench import NotStoppedError
from swarmctl.conformance.bench_runner import BOARD_CHECKS, run_checks
from swarmctl.conformance.board_bench import type_of
from swarmctl.conformance.results import Verdict, passed
from swarmctl.lab.emulators import VirtualPort
from swarmctl.lab.emulators.serial_faults import Faults
from tests.conformance.board_benches import Rover, bench_for, checked, config, tried

CHECKS = [
    "board", "protocol", "subscribes to commands", "topics", "firmware", "rate lwheel", "rate rwheel", "time",
    "forward, slow", "backward, slow", "forward, at the limit", "backward, at the limit", "left wheel alone",
    "right wheel alone", "turn to the left", "limits of the firmware", "stands after a stop",
    "dead-man of the firmware", "limits", "dead-man of the driver", "garbage", "half a frame", "TX_STOP",
    "latency", "line", "reconnect",
]  # fmt: skip
OK, WARN, FAIL = Verdict.OK, Verdict.WARN, Verdict.FAIL
MUTE = ("wedged", "dead after a reset")  # robots that only their own dead-man stops


@dataclass(frozen=True)
class Case:
    """The row that fails and its text; the robot's fault and settings, the line's faults."""

    row: str
    verdict: Verdict
    text: str
    fault: str = ""
    settings: Mapping[str, Any] = field(default_factory=dict)
    line: Faults = field(default_factory=Faults)
    check: str | None = None  # the name of its check, if different


FAULTS = [
    Case("board", FAIL, "has sent nothing for 15 s", line=Faults(stuck=True), check=""),
    Case("board", FAIL, "check the baud rate", fault="babble", check=""),
    Case("protocol", FAIL, "speaks rosserial 0.4", fault="old", check=""),
    Case("subscribes to commands", FAIL, "of another definition", line=Faults(wrong_md5=True), check=""),
    Case("subscribes to commands", FAIL, "does not subscribe to `cmd_vel`", fault="deaf", check=""),
    Case("subscribes to commands", FAIL, "larger buffers", fault="small buffers", check=""),
    Case("topics", FAIL, "does not publish `rwheel`", fault="one wheel"),
    Case("topics", FAIL, "`rwheel` is std_msgs/Int64, not std_msgs/Int32", fault="a longer number"),
    Case("topic sonar", FAIL, "install sensor_msgs", fault="one more", check="topics"),
    Case("firmware", WARN, "the sketch reports no digest", settings={"firmware": ""}),
    Case("rate lwheel", WARN, "20.0 of 10 Hz", settings={"rate": 20.0}, check="rates"),
    Case("rate rwheel", FAIL, "4.0 of 10 Hz", settings={"rate": 4.0}, check="rates"),
    Case("rate rwheel", FAIL, "0 messages", fault="one wheel silent", check="rates"),
    Case("time", FAIL, "requested never", line=Faults(no_time=True), check="rates"),
    Case("left wheel alone", FAIL, "the sides are swapped", fault="sides swapped", check="motion"),
    Case("turn to the left", FAIL, "the sides are swapped", fault="sides swapped", check="motion"),
    Case("forward, slow", FAIL, "counts the wrong way", fault="turns the wrong way", check="motion"),
    Case("forward, slow", FAIL, "the counters stand", fault="stands", check="motion"),
    Case("forward, slow", FAIL, "times as fast as commanded", fault="slow", check="motion"),
    Case("motion", FAIL, "no counts of both wheels", fault="one wheel silent"),
    Case("limits of the firmware", FAIL, "results in 1.497", settings={"top_speed": 2.0}),
    Case("stands after a stop", WARN, "no sooner than", fault="ignores zero"),
    Case("stands after a stop", FAIL, "1.4", fault="ignores zero", settings={"dead_man": 1.5}),
    Case("dead-man of the firmware", FAIL, "add a dead-man", settings={"dead_man": 60.0}),
    Case("dead-man of the firmware", FAIL, "1.2", settings={"dead_man": 1.2}),
    Case("dead-man of the firmware", WARN, "stutter", settings={"dead_man": 0.11}),
    Case("garbage", FAIL, "no command turns a wheel", fault="wedged"),
    Case("half a frame", FAIL, "no command turns a wheel", fault="wedged"),
    Case("TX_STOP", WARN, "still publishes lwheel, rwheel", fault="no goodbye"),
    Case("TX_STOP", FAIL, "the wheels keep turning", settings={"dead_man": 60.0}),
    Case("latency", WARN, "at most 70", line=Faults(delay=0.7)),
    Case("line", FAIL, "frames damaged", line=Faults(bad_checksum=0.1, seed=1)),
    Case("reconnect", FAIL, "without a driver", settings={"dtr": False, "dead_man": 60.0}),
    Case("reconnect", FAIL, "sent nothing", fault="dead after a reset"),
]  # fmt: skip


def test_a_board_that_matches_its_type_passes_every_check() -> None:
    results = tried(Rover())
    assert list(results) == CHECKS
    assert {one.check for one in results.values() if one.verdict is not OK} == set()
    assert results["topics"].figure.startswith("lwheel Int32 (4 of 120 bytes), ")
    assert results["limits"].figure == "5 m/s is sent as 0.5 m/s"
    assert results["dead-man of the firmware"].figure.startswith("0.4")


@pytest.mark.parametrize("case", FAULTS, ids=lambda case: f"{case.row}: {case.text}")
def test_each_fault_of_a_board_is_detected(case: Case) -> None:
    check = case.row if case.check is None else case.check
    found, stands = checked(check, Rover(case.fault, **case.settings), case.line)
    result = found[case.row]
    assert result.verdict is case.verdict, found
    assert case.text in f"{result.figure} {result.fix}"
    assert stands or case.fault in MUTE


@pytest.mark.parametrize(
    ("wanted", "verdict", "text"),
    [("0123456789ab", OK, "as in the spec"), ("ffffffffffff", FAIL, "the spec makes ffffffffffff")],
)
def test_the_firmware_digest_of_the_spec_is_compared(wanted: str, verdict: Verdict, text: str) -> None:
    found, _ = checked("firmware", Rover(), driver_config=config(firmware=wanted))
    assert found["firmware"].verdict is verdict
    assert text in found["firmware"].figure


def test_an_unknown_message_type_is_only_a_warning() -> None:
    more = {"lwheel": "std_msgs/Int32", "rwheel": "std_msgs/Int32", "sonar": "sensor_msgs/Range"}
    found, _ = checked("topics", Rover("one more"), driver_config=config(publishes=more))
    assert {name: found[name].verdict for name in ("topics", "topic sonar")} == {
        "topics": OK,
        "topic sonar": WARN,
    }


def test_an_unnamed_sketch_is_not_the_one_of_the_spec() -> None:
    found, _ = checked("firmware", Rover(firmware=""), driver_config=config(firmware="ffffffffffff"))
    assert found["firmware"].verdict is FAIL


def test_a_driver_without_limits_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        swarm_onboard.driver.rosserial_robot, "within_limits", lambda linear, angular, _: (linear, angular)
    )
    found, _ = checked("dead-man of the driver", Rover())
    assert found["limits"].verdict is FAIL


@pytest.mark.parametrize(("factor", "text"), [(1.3, "0.650 s"), (100.0, "no stop after")])
def test_a_driver_without_dead_man_is_detected(
    monkeypatch: pytest.MonkeyPatch, factor: float, text: str
) -> None:
    def late(commands: CommandMailbox, timeout: float, clock: Callable[[], float]) -> DeadMan:
        return DeadMan(commands, factor * timeout, clock)

    monkeypatch.setattr(swarm_onboard.driver.rosserial_robot, "DeadMan", late)
    found, _ = checked("dead-man of the driver", Rover())
    assert (found["limits"].verdict, found["dead-man of the driver"].verdict) == (OK, FAIL)
    assert text in found["dead-man of the driver"].figure


def test_nothing_is_sent_to_a_board_that_announces_nothing() -> None:
    port = VirtualPort(Rover("deaf"))
    results = list(run_checks(bench_for(port), BOARD_CHECKS))
    assert [one.check for one in results] == ["board", "protocol", "subscribes to commands"]
    assert not passed(results)
    assert "cmd_vel" not in port.robot.state.last_command


def test_a_board_that_does_not_stop_is_reported() -> None:
    """Its firmware ignores stop commands and has no dead-man."""
    running = run_checks(
        bench_for(VirtualPort(Rover("ignores zero", dead_man=1000.0, dtr=False))), BOARD_CHECKS
    )
    with pytest.raises(NotStoppedError, match="the wheels still turn"):
        list(running)


@pytest.mark.parametrize("interrupted_after", ["board", "forward, slow", "limits", "TX_STOP"])
def test_the_rover_stands_whenever_the_test_is_aborted(interrupted_after: str) -> None:
    port = VirtualPort(Rover())
    running = run_checks(bench_for(port), BOARD_CHECKS)
    for one in running:
        if one.check == interrupted_after:
            break
    running.close()
    assert port.robot.state.v == 0.0


def test_message_types_are_known_without_ros() -> None:
    """Their digests are those of `rosmsg md5` of noetic."""
    known = {name: type_of(f"std_msgs/{name}") for name in ("Int16", "Int32", "String", "Bool", "Float32")}
    assert {name: one and (one.md5sum, one.least) for name, one in known.items()} == {
        "Int16": ("8524586e34fbd7cb1c08c5f5f1ca0e57", 2),
        "Int32": ("da5909fbe378aeaf85e547e830cc1bb7", 4),
        "String": ("992ce8a1687cec8c8bd883ec73ca41d1", 4),
        "Bool": ("8b94c1b53db61fb6aed406028ad6332a", 1),
        "Float32": ("73fcbf46b49191e672908e50842a83d4", 4),
    }
    assert type_of("sensor_msgs/Range") is None
