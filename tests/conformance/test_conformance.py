"""Every check of `driver test` passes on a robot that is as its type says, and fails on one that is not."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import swarm_onboard.driver.session
from swarm_onboard.command.command_mailbox import CommandMailbox
from swarm_onboard.command.dead_man import DeadMan
from swarm_onboard.driver.config import Kinematics, Scale
from swarm_onboard.driver.kinematics import Pose, Units
from swarm_onboard.driver.link import BytePort
from swarm_onboard.driver.port import PortError

from swarmctl.conformance import driver_checks, motion_checks, protocol_checks
from swarmctl.conformance.bench import NotStoppedError, Pace
from swarmctl.conformance.bench_runner import POLLED_CHECKS, run_checks
from swarmctl.conformance.polled_bench import PolledBench
from swarmctl.conformance.results import Result, Verdict, config_for, passed
from swarmctl.lab.emulators import emulator
from swarmctl.lab.emulators.emulator_lookup import EMULATED_AS
from swarmctl.lab.emulators.serial_faults import Faults
from swarmctl.lab.emulators.serial_robot import Port
from swarmctl.robot_types.any_robot_type import with_protocol
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.scaffold.starting_files import codec_text
from swarmctl.spec.catalog import load_catalog
from swarmctl.views import conformance as view
from swarmctl.yamltext.source import parse
from tests.conformance.user_robots import OWN, TYPE, beetle
from tests.sizes import some_of

Check = Callable[[PolledBench], Iterator[Result]]
FAST = Pace(settle=0.05, measure=0.2, silence=0.7, questions=20)
HASTY = TYPE.replace("reply_timeout: 1.0", "reply_timeout: 0.5")
CHECKS = [
    "stop", "firmware", "sensor odom", "sensor battery", "sensor eyes", "actuator lamp", "forward, slow",
    "backward, slow", "forward, at the limit", "backward, at the limit", "left wheel alone",
    "right wheel alone", "turn to the left", "stands after a stop", "limits", "dead-man of the driver",
    "driver killed in motion", "half a request", "reconnect", "replies",
]  # fmt: skip


def type_of(text: str) -> RobotType:
    source, _ = parse(text, "beetle.yaml")
    return RobotType.model_validate(source.data)


def bench_for(port: Port, text: str = TYPE, module: Path = Path()) -> PolledBench:
    robot_type = type_of(text)
    config = config_for(robot_type, "beetle", str(port.path), None, str(module))
    dead_man = robot_type.firmware_dead_man
    return PolledBench(config, firmware_dead_man=dead_man, pace=FAST)


def tried(
    fault: str = "", check: Check | None = None, text: str = TYPE, faults: Faults | None = None
) -> dict[str, Result]:
    """Results of all checks, or of one, by name; and whatever happened, the robot stands."""
    with beetle(fault) as port:
        bench = bench_for(port, text)
        port.faults = faults or Faults()
        if check is None:
            results = list(run_checks(bench, POLLED_CHECKS))
        else:
            bench.connect()
            results = list(check(bench))
            bench.finish()
        assert fault == "never stops" or not port.snapshot().v
    assert len({one.check for one in results}) == len(results)
    return {one.check: one for one in results}


def test_a_robot_that_matches_its_type_passes_every_check() -> None:
    for _ in range(3):  # a busy machine may be late with a reply
        results = tried()
        doubtful = {one.check for one in results.values() if one.verdict is not Verdict.OK}
        if not doubtful:
            break
    assert doubtful == set()
    assert list(results) == CHECKS
    assert results["firmware"].figure == "beetle,1: 1000 units are 1 m/s"
    assert results["limits"].figure == "2.5 m/s is sent as `S,250,250`"
    assert results["sensor battery"].figure == "3.80 V"


FAULTS: dict[Check, list[tuple[str, str, Verdict, str]]] = {
    protocol_checks.reports_firmware: [("no firmware", "firmware", Verdict.FAIL, "identify")],
    protocol_checks.answers_queries: [
        ("short reply", "query position", Verdict.FAIL, "has 1 values instead of 2"),
        ("wild eyes", "sensor eyes", Verdict.WARN, "999 is outside 0 to 255"),
        ("flat battery", "sensor battery", Verdict.WARN, "0.38 V"),
    ],
    protocol_checks.sets_actuators: [("no lamp", "actuator lamp", Verdict.FAIL, "the robot answers `!`")],
    motion_checks.drives_as_commanded: [
        ("twice as fast", "forward, slow", Verdict.FAIL, "times as fast as commanded"),
        ("a bit fast", "forward, at the limit", Verdict.WARN, "times as fast as commanded"),
        ("swapped", "left wheel alone", Verdict.FAIL, "the sides are swapped"),
        ("swapped", "turn to the left", Verdict.FAIL, "the sides are swapped"),
        ("backward", "forward, slow", Verdict.FAIL, "runs the wrong way"),
        ("left counter backward", "forward, slow", Verdict.FAIL, "runs the wrong way"),
        ("one wheel", "right wheel alone", Verdict.FAIL, "the counters stand"),
        ("no wheels", "forward, slow", Verdict.FAIL, "the counters stand"),
        ("counters stand", "forward, slow", Verdict.FAIL, "the counters stand"),
    ],
    motion_checks.stands_after_stop: [
        ("never stops", "stands after a stop", Verdict.FAIL, "but keeps driving")
    ],
    motion_checks.stops_by_itself: [
        ("dead-man", "driver killed in motion", Verdict.WARN, "firmware_dead_man: true")
    ],
    protocol_checks.recovers_from_half_a_request: [
        ("takes offence", "half a request", Verdict.FAIL, "a stop is not confirmed"),
    ],
}


@pytest.mark.parametrize(
    ("check", "fault", "name", "verdict", "text"),
    [(check, *one) for check, faults in FAULTS.items() for one in faults],
)
def test_each_fault_of_a_robot_is_detected(
    check: Check, fault: str, name: str, verdict: Verdict, text: str
) -> None:
    result = tried(fault, check)[name]
    assert result.verdict is verdict, result
    assert text in f"{result.figure} {result.fix}"


def test_a_robot_that_restarts_with_its_line_is_detected() -> None:
    with beetle() as port:
        bench = bench_for(port, HASTY)
        bench.connect()
        opened = bench.open_port

        def restarted() -> BytePort:
            with port.now() as robot:
                robot.sulks = 8  # it is busy with itself
            return opened()

        bench.open_port = restarted
        [result] = protocol_checks.recovers_from_a_reconnect(bench)
        bench.finish()
    assert result.verdict is Verdict.FAIL
    assert "raise `settle` of the link" in result.fix


@pytest.mark.parametrize(
    ("setup", "verdict", "text"),
    [("{send: P, reply: p}", Verdict.OK, "confirmed"), ("{send: X, reply: x}", Verdict.FAIL, "answers `!`")],
)
def test_a_refused_setup_request_fails(setup: str, verdict: Verdict, text: str) -> None:
    [result] = tried(
        "", protocol_checks.accepts_setup, TYPE.replace("  queries:", f"  setup: [{setup}]\n  queries:")
    ).values()
    assert result.verdict is verdict
    assert text in result.figure


def test_a_driver_without_limits_is_detected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(swarm_onboard.driver.session, "wheel_units", unlimited)
    results = tried("", driver_checks.driver_dead_man_stops)
    assert results["limits"].verdict is Verdict.FAIL
    assert "S,2500,2500" in results["limits"].figure


@pytest.mark.parametrize("factor", some_of([4.0, 100.0], [4.0]))
@pytest.mark.parametrize("own", [False, True], ids=["line", "python"])
def test_a_driver_without_dead_man_is_detected(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, factor: float, own: bool
) -> None:
    def late(commands: CommandMailbox, timeout: float, clock: Callable[[], float]) -> DeadMan:
        return DeadMan(commands, factor * timeout, clock)

    monkeypatch.setattr(swarm_onboard.driver.session, "DeadMan", late)
    results = of_a_class(tmp_path) if own else tried("", driver_checks.driver_dead_man_stops)
    assert results["limits"].verdict is Verdict.OK
    assert results["dead-man of the driver"].verdict is Verdict.FAIL


def unlimited(linear: float, angular: float, built: Kinematics, scale: Scale) -> Units:
    speed = round(linear * scale.speed_units_per_mps)
    return speed, speed


def of_a_class(folder: Path, *change: str, text: str = OWN) -> dict[str, Result]:
    """Limits and dead-man of a driver that speaks through a class, whose text is changed so."""
    module = folder / "beetle.py"
    module.write_text(codec_text("beetle").replace(*(change or ("", ""))))
    with beetle() as port:
        bench = bench_for(port, text, module)
        bench.connect()
        results = {one.check: one for one in driver_checks.driver_dead_man_stops(bench)}
        bench.finish()
    return results


def test_limits_of_a_user_codec_are_measured_at_the_wheels(tmp_path: Path) -> None:
    """A class may number its requests, so its bytes cannot be compared."""
    results = of_a_class(tmp_path)
    assert {one.verdict for one in results.values()} == {Verdict.OK}
    assert results["limits"].figure.endswith("the limit is 0.25")
    fast = of_a_class(tmp_path, '(f"S,{left},{right}"', '(f"S,{2 * left},{2 * right}"')
    assert fast["limits"].verdict is Verdict.FAIL


def test_a_user_codec_without_counters_is_a_warning(tmp_path: Path) -> None:
    blind = OWN.split("  queries:")[0] + OWN[OWN.index("firmware_dead_man") :]
    results = of_a_class(tmp_path, text=blind)
    assert {one.verdict for one in results.values()} == {Verdict.WARN}


def test_a_driver_with_a_user_codec_without_limits_is_detected(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(swarm_onboard.driver.session, "wheel_units", unlimited)
    assert of_a_class(tmp_path)["limits"].verdict is not Verdict.OK


def test_jumps_are_no_slow_motion(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """On a busy machine, what odometry keeps of a driver without limits may look plausible."""
    monkeypatch.setattr(driver_checks.Run, "speed", 0.2)
    assert of_a_class(tmp_path)["limits"].verdict is Verdict.OK
    monkeypatch.setattr(swarm_onboard.driver.session, "wheel_units", unlimited)
    assert of_a_class(tmp_path)["limits"].verdict is Verdict.FAIL


def test_wheels_that_go_on_never_stood() -> None:
    """Two readings in quick succession are equal while the wheels turn."""
    run = driver_checks.Run(lambda: 0.0, last=1.0)
    run.poses = [
        (at, Pose(left=way)) for at, way in ((1.1, 0.1), (1.2, 0.2), (1.2, 0.2), (1.3, 0.3), (1.4, 0.4))
    ]
    assert run.stood is None
    run.poses += [(1.5, run.poses[-1][1]), (1.6, run.poses[-1][1])]
    assert run.stood == 1.5


def test_a_wrong_scale_is_reported_with_the_right_one() -> None:
    fix = tried("twice as fast", motion_checks.drives_as_commanded)["forward, at the limit"].fix
    units, metres = (
        float(fix.split(f"{name}: ")[1].split(",")[0].split(";")[0])
        for name in ("speed_units_per_mps", "metres_per_count")
    )
    assert units == pytest.approx(500, rel=0.05)
    assert metres == pytest.approx(0.00025, rel=0.05)


def test_a_declared_dead_man_must_exist() -> None:
    declared = TYPE.replace("firmware_dead_man: false", "firmware_dead_man: true")
    [found] = tried("", motion_checks.stops_by_itself, declared).values()
    assert found.verdict is Verdict.FAIL
    [found] = tried("dead-man", motion_checks.stops_by_itself, declared).values()
    assert found.verdict is Verdict.OK
    assert 0.2 < float(found.figure.split()[5]) < 0.6


@pytest.mark.parametrize(
    ("faults", "verdict", "text"),
    [
        (Faults(delay=0.38), Verdict.WARN, "of 500 ms"),
        (Faults(drop=0.15, seed=3), Verdict.FAIL, "raise `reply_timeout`"),
    ],
    ids=["late replies", "lost replies"],
)
def test_a_bad_line_is_detected(faults: Faults, verdict: Verdict, text: str) -> None:
    [result] = tried("", protocol_checks.answers_in_time, HASTY, faults).values()
    assert result.verdict is verdict
    assert text in f"{result.figure} {result.fix}"


def test_garbage_before_replies_is_tolerated() -> None:
    """Half a line before a reply spoils it now and then; the driver asks again."""
    results = tried(faults=Faults(garbage=0.02, seed=5))
    assert results["reconnect"].verdict is not Verdict.FAIL


def test_no_queries_to_a_robot_that_cannot_be_stopped() -> None:
    results: list[Result] = []
    with beetle("mute") as port, pytest.raises(NotStoppedError, match="no reply to `S,0,0`"):
        results.extend(run_checks(bench_for(port, HASTY), POLLED_CHECKS))
    assert [(one.check, one.verdict, one.fix) for one in results] == [("stop", Verdict.FAIL, "is it asleep?")]
    assert "received nothing\n" in view.line(results[0]).plain
    assert port.robot.state.last_command == "S,0,0"


def test_a_wrong_reply_is_shown_with_its_bytes() -> None:
    result = tried("short reply", protocol_checks.answers_queries)["query position"]
    assert result.received is not None
    assert result.received.startswith(b"p,")
    assert f"received {result.received.hex(' ')}  'p," in view.line(result).plain
    assert result.to_json()["received"] == result.received.hex(" ")


def test_an_unplugged_cable_ends_the_test() -> None:
    results: list[Result] = []
    with beetle() as port:
        running = run_checks(bench_for(port), POLLED_CHECKS)
        while not results or results[-1].check != "forward, slow":
            results.append(next(running))
        port.unplug()
        with pytest.raises(NotStoppedError, match=r"is missing|is gone"):
            results.extend(running)
    assert results[-1].check == "line"
    assert not passed(results)


def test_a_missing_port_is_an_error() -> None:
    with beetle() as port:
        bench = bench_for(port)
    with pytest.raises(PortError, match="is missing"):
        next(run_checks(bench, POLLED_CHECKS))


@pytest.mark.parametrize(
    "interrupted_after",
    some_of(["stop", "sensor odom", "forward, slow", "limits", "half a request"], ["forward, slow"]),
)
def test_the_robot_stands_whenever_the_test_is_aborted(interrupted_after: str) -> None:
    with beetle() as port:
        running = run_checks(bench_for(port), POLLED_CHECKS)
        for one in running:
            if one.check == interrupted_after:
                break
        running.close()
        assert not port.snapshot().v


@pytest.mark.parametrize(
    "name", sorted(name for name, one in with_protocol(load_catalog().types).items() if one.driver_protocol)
)
def test_every_emulated_robot_matches_its_shipped_type(name: str) -> None:
    """Types and emulators are written from the manuals by themselves: here they meet."""
    robot_type = with_protocol(load_catalog().types)[name]
    unhurried = {"protocol": robot_type.protocol.model_copy(update={"reply_timeout": 2.0})}
    robot_type = robot_type.model_copy(update=unhurried)  # the emulator may get no processor for long
    with Port(emulator(EMULATED_AS.get(name, name))) as port:
        config = config_for(robot_type, name, str(port.path), None, "")
        bench = PolledBench(config, firmware_dead_man=robot_type.firmware_dead_man, pace=FAST)
        results = list(run_checks(bench, POLLED_CHECKS))
        assert not port.snapshot().v
    assert [one.verdict for one in results if one.check == "driver killed in motion"] == [Verdict.OK]
    assert [one for one in results if one.verdict is Verdict.FAIL] == []
