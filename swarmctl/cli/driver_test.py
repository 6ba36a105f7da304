"""``swarmctl driver test``: a robot, real or emulated, put to the test over its own line."""

from __future__ import annotations

import signal
import sys
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import access, console, exits
from swarmctl.cli.driver import Folder, the_type

if TYPE_CHECKING:
    from swarm_driver.config import Config

    from swarmctl.conformance.results import Result
    from swarmctl.spec.robot_type import RobotType
    from swarmctl.views.robot_types import Shown

    Examination = Generator[Result, None, None]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_ONCE_MORE = 0.25  # s in which a class that hangs must have let go
_MOST_ALARMS = 2
_HANGS = "a call of the protocol's class takes longer than a driver waits"
_RAISED = "its wheels must not touch the ground: it drives at its limit, forward, backward and on the spot"


def put_to_the_test(
    name: Annotated[
        str,
        typer.Argument(metavar="NAME", help="The robot's type (see `driver list`); with --spec the robot."),
    ],
    port: Annotated[
        Path, typer.Option("--port", metavar="PORT", help="Its serial port, or that of an emulator.")
    ],
    baud: Annotated[
        int | None,
        typer.Option("--baud", min=300, max=4_000_000, help="Bits per second; the type's if left out."),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Its wheels are off the ground: do not ask.")] = False,
    spec: Annotated[
        Path | None,
        typer.Option(
            "--spec",
            metavar="SPEC",
            help="NAME is a robot of this swarm: as its settings say, with its sketch.",
        ),
    ] = None,
    folder: Folder = Path(),
    json: access.Json = False,
) -> None:
    """Put a robot to the test: stop, firmware, every question and light, motion, limits, dead-man, latencies.

    The driver's own code speaks, without ROS; to a board that speaks rosserial, too. Exit code 1 if a check
    fails. Ctrl-C stops the robot.
    """
    run = _of_a_swarm(spec, name, port, baud) if spec else _of_a_type(the_type(name, folder), port, baud)
    _agreed(name, yes)
    _told(name, port, _examined(run, json=json), json=json)


def _agreed(name: str, yes: bool) -> None:
    """Go on only with a robot that cannot drive away."""
    if yes:
        return
    if not sys.stdin.isatty():
        console.fail(_RAISED, "lift the robot, then say so with --yes", code=exits.USAGE)
    typer.echo(f"{name}: {_RAISED}.", err=True)
    if not typer.confirm("Are its wheels off the ground?", err=True):
        console.fail("nothing was sent", "lift the robot, and come back")


def _of_a_type(shown: Shown, port: Path, baud: int | None) -> Examination:
    from swarmctl.conformance.core import config_for
    from swarmctl.spec.codecs import codec_beside

    module = codec_beside(Path(shown.source)).resolve()
    config = config_for(shown.type, shown.name, str(port), baud, str(module))
    return _on_the_bench(config, shown.type)


def _of_a_swarm(spec: Path, name: str, port: Path, baud: int | None) -> Examination:
    """What the spec says of its robot: settings, calibration, and the sketch that is made from them."""
    import yaml

    from swarmctl.cli.layers import Layers
    from swarmctl.conformance.core import config_of
    from swarmctl.render.ros1 import parameters
    from swarmctl.spec.codecs import codec_beside
    from swarmctl.spec.suggest import did_you_mean

    swarm = console.read_spec(Layers((spec,)))
    robot = swarm.robots.get(name)
    if robot is None:
        console.fail(
            f"there is no robot called `{name}` in {spec}",
            *did_you_mean(name, swarm.robots, "the robots are"),
            code=exits.USAGE,
        )
    module = codec_beside(spec.parent / "robots" / f"{robot.type_name}.yaml").resolve()
    config = config_of(yaml.safe_load(parameters(robot)), str(port), baud, str(module))
    return _on_the_bench(config, robot.type)


def _on_the_bench(config: Config, robot_type: RobotType) -> Examination:
    from swarmctl.conformance.bench import Bench
    from swarmctl.conformance.board_bench import BoardBench
    from swarmctl.conformance.core import open_port
    from swarmctl.conformance.examine import ASKED, BOARD, examine

    if robot_type.asked is None:
        return examine(BoardBench(config, lambda: open_port(config)), BOARD)
    dead_man = robot_type.firmware_dead_man
    return examine(Bench(config, lambda: open_port(config), firmware_dead_man=dead_man), ASKED)


def _examined(run: Examination, *, json: bool) -> list[Result]:
    """Every result, told as it comes; what keeps it from beginning or from ending well ends the program."""
    from swarmctl.conformance.core import PortError
    from swarmctl.conformance.wheeled import BreakOffError, NotStoppedError, TooLongError
    from swarmctl.views import conformance as view

    results: list[Result] = []
    try:
        with _signals(), closing(run) as found:
            for one in found:
                results.append(one)
                if not json:
                    console.out().print(view.line(one))
    except BreakOffError:
        console.fail("interrupted; the robot has confirmed a stop", code=exits.INTERRUPTED)
    except TooLongError as error:
        console.fail(str(error), "on a host this ends the driver, and then stops the motors")
    except NotStoppedError as error:
        console.fail(f"nobody knows whether the robot stands: {error}", "switch it off")
    except PortError as error:
        console.fail(str(error), "`ls -l /dev/serial/by-id` shows the serial ports that there are")
    return results


@contextmanager
def _signals() -> Iterator[None]:
    """The first signal ends the test in order; those after it do not disturb the stop."""
    from swarmctl.conformance.wheeled import BreakOffError, TooLongError

    def end(*_: Any) -> None:
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        raise BreakOffError

    alarms = 0

    def too_long(*_: Any) -> None:
        """A class may catch even this: then the program ends at once, as a driver does."""
        nonlocal alarms
        alarms += 1
        signal.setitimer(signal.ITIMER_REAL, _ONCE_MORE)
        if alarms > _MOST_ALARMS:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
        raise TooLongError(_HANGS)

    before = {number: signal.signal(number, end) for number in _SIGNALS}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, too_long)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _told(name: str, port: Path, results: list[Result], *, json: bool) -> None:
    from swarmctl.conformance.results import passed
    from swarmctl.views import conformance as view

    if json:
        told = [one.to_json() for one in results]
        console.print_json(
            {"v": 1, "type": name, "port": str(port), "passed": passed(results), "results": told}
        )
    else:
        console.out().print(f"\n{view.verdict(results)}")
    if not passed(results):
        raise typer.Exit(exits.ERROR)
