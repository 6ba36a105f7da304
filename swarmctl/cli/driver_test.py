"""``swarmctl driver test``: a robot, real or emulated, put to the test over its own line."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import access, console, exits
from swarmctl.cli.driver import Folder, the_type

if TYPE_CHECKING:
    from swarmctl.conformance.bench import Bench
    from swarmctl.conformance.results import Result
    from swarmctl.views.robot_types import Shown

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_RAISED = "its wheels must not touch the ground: it drives at its limit, forward, backward and on the spot"


def put_to_the_test(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot's type: see `driver list`.")],
    port: Annotated[
        Path, typer.Option("--port", metavar="PORT", help="Its serial port, or that of an emulator.")
    ],
    baud: Annotated[
        int | None,
        typer.Option("--baud", min=300, max=4_000_000, help="Bits per second; the type's if left out."),
    ] = None,
    yes: Annotated[bool, typer.Option("--yes", help="Its wheels are off the ground: do not ask.")] = False,
    folder: Folder = Path(),
    json: access.Json = False,
) -> None:
    """Put a robot to the test: stop, firmware, every question and light, motion, limits, dead-man, latencies.

    The driver's own code speaks, without ROS. Exit code 1 if a check fails. Ctrl-C stops the robot.
    """
    shown = the_type(name, folder)
    if shown.type.asked is None:
        console.fail(
            f"`{name}` answers no questions: its board speaks rosserial, which is not asked",
            "deploy the swarm: `swarmctl status` tells how its line and its sketch are; without a robot, "
            "`swarmctl lab up SPEC --boards` runs the sketch on a simulated board",
            code=exits.USAGE,
        )
    _agreed(name, yes)
    results = _examined(_bench(shown, port, baud), json=json)
    _told(name, port, results, json=json)


def _agreed(name: str, yes: bool) -> None:
    """Go on only with a robot that cannot drive away."""
    if yes:
        return
    if not sys.stdin.isatty():
        console.fail(_RAISED, "lift the robot, then say so with --yes", code=exits.USAGE)
    typer.echo(f"{name}: {_RAISED}.", err=True)
    if not typer.confirm("Are its wheels off the ground?", err=True):
        console.fail("nothing was sent", "lift the robot, and come back")


def _bench(shown: Shown, port: Path, baud: int | None) -> Bench:
    from swarmctl.conformance.bench import Bench
    from swarmctl.conformance.core import config_for, open_port
    from swarmctl.spec.codecs import codec_beside

    module = codec_beside(Path(shown.source)).resolve()
    config = config_for(shown.type, shown.name, str(port), baud, str(module))
    return Bench(config, lambda: open_port(config), firmware_dead_man=shown.type.firmware_dead_man)


def _examined(bench: Bench, *, json: bool) -> list[Result]:
    """Every result, told as it comes; what keeps it from beginning or from ending well ends the program."""
    from swarmctl.conformance.bench import NotStoppedError
    from swarmctl.conformance.core import BreakOffError, PortError, TooLongError
    from swarmctl.conformance.examine import examine
    from swarmctl.views import conformance as view

    results: list[Result] = []
    try:
        with _signals(), closing(examine(bench)) as found:
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
    from swarmctl.conformance.core import BreakOffError, TooLongError

    def end(*_: Any) -> None:
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        raise BreakOffError

    def too_long(*_: Any) -> None:
        raise TooLongError("a call of the protocol's class takes longer than a driver waits")

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
