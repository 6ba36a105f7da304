"""``swarmctl driver``: its verbs, which are in the modules ``driver_*``."""

from __future__ import annotations

import re
import signal
import sys
from collections.abc import Generator, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import complete, console, exit_codes, file_writes, options, selected

if TYPE_CHECKING:
    from swarm_onboard.driver.config import Config

    from swarmctl.conformance.results import Result
    from swarmctl.robot_types.robot_type import RobotType
    from swarmctl.views.robot_types import Shown


Folder = Annotated[
    Path,
    typer.Option("--dir", metavar="DIR", help="The folder of the spec; your own types are in DIR/robots."),
]


def list_(folder: Folder = Path(), json: options.Json = False) -> None:
    """List the robot types that swarmctl ships and those in DIR/robots."""
    from swarmctl.views import robot_types as view

    types, wrong = known_types(folder)
    if json:
        console.print_json({"v": 1, "types": [view.listed(one) for one in types.values()]})
    else:
        console.out().print(view.table(types.values()))
    if wrong:
        raise typer.Exit(exit_codes.ERROR)


def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="The robot type (see `driver list`).", autocompletion=complete.types
        ),
    ],
    folder: Folder = Path(),
    json: options.Json = False,
) -> None:
    """Show a robot type: serial line, limits, requests, topics and dead-man timeouts."""
    from swarmctl.views import robot_types as view

    shown = the_type(name, folder)
    if json:
        console.print_json({"v": 1, **view.detailed(shown)})
    else:
        page = view.page(shown)
        page.rstrip()
        console.show(page)


def known_types(folder: Path) -> tuple[dict[str, Shown], bool]:
    """All types by name, and True if files beside the spec have errors, which are printed."""
    from swarmctl.diagnostics import has_errors
    from swarmctl.spec.catalog import load_catalog
    from swarmctl.views.robot_types import SHIPPED, Shown

    catalog = load_catalog(folder / "robots")
    console.print_diagnostics(catalog.diagnostics)
    sources = {name: source.path for name, source in catalog.sources.items()}
    types = {
        name: Shown(name, sources.get(name, SHIPPED), one) for name, one in sorted(catalog.types.items())
    }
    return types, has_errors(catalog.diagnostics)


def the_type(name: str, folder: Path) -> Shown:
    """The type called ``name``; exits with an error if there is none or it has errors."""
    from swarmctl.suggest import did_you_mean

    types, _ = known_types(folder)
    if name not in types:
        if (folder / "robots" / f"{name}.yaml").exists():  # and what is wrong with it stands above
            raise typer.Exit(exit_codes.ERROR)
        console.fail(
            f"there is no robot type `{name}`",
            *did_you_mean(name, types, "there are"),
            f"your own types are in {folder / 'robots'}; `swarmctl driver new {name}` writes one",
            code=exit_codes.USAGE,
        )
    return types[name]


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The new type's name, such as beetle.")],
    protocol: Annotated[
        str,
        typer.Option(
            "--protocol",
            metavar="KIND",
            help="line (text), binary, python (a class of your own) or rosserial.  [default: line]",
            show_default=False,
        ),
    ] = "",
    driver: Annotated[
        str,
        typer.Option(
            "--driver",
            metavar="PACKAGE/FILE",
            help="An executable or launch file of a ROS package drives the robot: rosaria/RosAria.",
            show_default=False,
        ),
    ] = "",
    folder: Folder = Path(),
) -> None:
    """Write a commented robot type to DIR/robots/NAME.yaml; with --protocol python also a codec to NAME.py.

    Values that only you know are empty: `driver show NAME` lists them, `driver test NAME` tries a protocol.
    """
    from swarmctl.robot_types.protocols import PROTOCOLS
    from swarmctl.scaffold import starting_files
    from swarmctl.suggest import did_you_mean

    _check_name(name)
    if protocol and driver:
        console.fail("--protocol and --driver exclude each other", code=exit_codes.USAGE)
    protocol = protocol or "line"
    package, file_name = _driver(driver) if driver else ("", "")
    if protocol not in PROTOCOLS:
        console.fail(
            f"there is no protocol kind `{protocol}`",
            *did_you_mean(protocol, PROTOCOLS, "the kinds are"),
            "for a driver that is a ROS package: --driver PACKAGE/FILE",
            code=exit_codes.USAGE,
        )
    file = folder / "robots" / f"{name}.yaml"
    with _readable_errors(file):
        for path in (file, file.with_suffix(".py")):
            if path.exists():
                console.fail(f"{path} exists already", "choose another name, or remove the file first")
        schema = (folder / ".swarmctl").is_dir()
        if driver:
            files = {file: starting_files.ros_type_text(name, package, file_name, schema=schema)}
        else:
            files = {file: starting_files.type_text(name, protocol, schema=schema)}
        if protocol == "python":
            files[file.with_suffix(".py")] = starting_files.codec_text(name)
        for path, text in files.items():
            file_writes.create(path, text.encode())
    for path in files:
        console.out().print(f"{path}: written")
    at = "" if folder == Path() else f" --dir {folder}"
    console.out().print(f"fill in its empty values; this lists them: swarmctl driver show {name}{at}")


def _driver(text: str) -> tuple[str, str]:
    """The package of ``--driver``, and its executable or launch file; the folder `launch` may be named."""
    from pydantic import TypeAdapter, ValidationError

    from swarmctl.field_types import LaunchFile, PackageName

    package, _, file = text.partition("/")
    file = file.removeprefix("launch/")
    try:
        TypeAdapter(PackageName).validate_python(package)
        TypeAdapter(LaunchFile).validate_python(file)
    except ValidationError:
        console.fail(
            f"--driver: `{text}` does not name a file of a ROS package",
            "write PACKAGE/EXECUTABLE or PACKAGE/FILE.launch, such as rosaria/RosAria",
            code=exit_codes.USAGE,
        )
    return package, file


def _check_name(name: str) -> None:
    from swarmctl.field_types import ROBOT_TYPE_NAME

    if not re.fullmatch(ROBOT_TYPE_NAME, name, re.ASCII) or name.endswith("\n"):
        console.fail(
            f"`{name}` cannot be the name of a robot type",
            "use lower-case letters, digits, dots and hyphens, a letter first, 31 at most",
            code=exit_codes.USAGE,
        )


@contextmanager
def _readable_errors(file: Path) -> Iterator[None]:
    """Ends the program with the file's name and the reason where the operating system refuses an access."""
    try:
        yield
    except OSError as error:
        console.fail(console.cannot_write(error, file), "choose another --dir")


if TYPE_CHECKING:
    Examination = Generator[Result, None, None]

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_NEXT_ALARM = 0.25  # s until a class that still hangs is interrupted again
_MOST_ALARMS = 2
_HANGS = "a call of the protocol's class exceeds the time limit of a driver"
_RAISED = "the wheels must not touch the ground: the robot drives at its speed limit and turns on the spot"


def driver_test(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            help="The robot type (see `driver list`); with --spec, the robot.",
            autocompletion=complete.types,
        ),
    ],
    port: Annotated[
        Path, typer.Option("--port", metavar="PORT", help="The serial port of the robot or of an emulator.")
    ],
    baud: Annotated[
        int | None,
        typer.Option("--baud", min=300, max=4_000_000, help="Baud rate; by default that of the type."),
    ] = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Do not ask whether the wheels are off the ground.")
    ] = False,
    spec: Annotated[
        Path | None,
        typer.Option(
            "--spec",
            metavar="SPEC",
            help="NAME is a robot of this swarm; its settings and its sketch apply.",
        ),
    ] = None,
    folder: Folder = Path(),
    json: options.Json = False,
) -> None:
    """Test a robot: stop, firmware, sensors, lights, motion, limits, dead-man timeout and latencies.

    Runs the driver's code without ROS, also for boards with rosserial. Exit code 1 if a check fails.
    Ctrl-C stops the robot.
    """
    run = (
        _robot_of_swarm(spec, name, port, baud)
        if spec
        else _robot_of_type(the_type(name, folder), port, baud)
    )
    _confirm_lifted(name, yes)
    _print_summary(name, port, _run_checks(run, json=json), json=json)


def _confirm_lifted(name: str, yes: bool) -> None:
    """Exit unless the user confirms that the robot cannot drive away."""
    if yes:
        return
    if not sys.stdin.isatty():
        console.fail(_RAISED, "lift the robot, then run the same command with --yes", code=exit_codes.USAGE)
    typer.echo(f"{name}: {_RAISED}.", err=True)
    if not typer.confirm("Are the wheels off the ground?", err=True):
        console.fail("nothing was sent", "lift the robot, then run the same command again")


def _foreign(name: str) -> tuple[str, str]:
    """The error and the help for a robot that swarmctl's driver does not drive."""
    return (
        f"a ROS package drives `{name}`; `driver test` checks robots that swarmctl's driver drives",
        "deploy it, then `swarmctl status` checks its topics",
    )


def _robot_of_type(shown: Shown, port: Path, baud: int | None) -> Examination:
    from swarmctl.conformance.results import config_for
    from swarmctl.robot_types.codec_check import codec_beside
    from swarmctl.robot_types.robot_type import RobotType

    module = codec_beside(Path(shown.source)).resolve()
    if not isinstance(shown.type, RobotType):
        console.fail(*_foreign(shown.name), code=exit_codes.USAGE)
    config = config_for(shown.type, shown.name, str(port), baud, str(module))
    return _on_the_bench(config, shown.type)


def _robot_of_swarm(spec: Path, name: str, port: Path, baud: int | None) -> Examination:
    """The checks of a robot with the settings, the calibration and the sketch of its spec."""
    import yaml

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.conformance.results import config_of
    from swarmctl.render.driver_config import parameters
    from swarmctl.robot_types.codec_check import codec_beside
    from swarmctl.swarm.resolved import SwarmctlDriver

    swarm = console.read_spec(SpecFiles((spec,)))
    robot = swarm.robots[selected.one(swarm.candidates, name, "robots", "NAME")]
    if not isinstance(robot.driver, SwarmctlDriver):
        console.fail(*_foreign(robot.name), code=exit_codes.USAGE)
    module = codec_beside(spec.parent / "robots" / f"{robot.type_name}.yaml").resolve()
    config = config_of(yaml.safe_load(parameters(robot, robot.driver)[0]), str(port), baud, str(module))
    return _on_the_bench(config, robot.driver.type)


def _on_the_bench(config: Config, robot_type: RobotType) -> Examination:
    from swarmctl.conformance.bench_runner import BOARD_CHECKS, POLLED_CHECKS, run_checks
    from swarmctl.conformance.board_bench import BoardBench
    from swarmctl.conformance.polled_bench import PolledBench

    if robot_type.driver_protocol is None:
        return run_checks(BoardBench(config), BOARD_CHECKS)
    return run_checks(PolledBench(config, firmware_dead_man=robot_type.firmware_dead_man), POLLED_CHECKS)


def _run_checks(run: Examination, *, json: bool) -> list[Result]:
    """All results, printed as they arrive; exits with an error if the run fails."""
    from swarm_onboard.driver.port import PortError

    from swarmctl.conformance.bench import AbortError, HangError, NotStoppedError
    from swarmctl.views import conformance as view

    results: list[Result] = []
    try:
        with _signals(), closing(run) as found:
            for one in found:
                results.append(one)
                if not json:
                    console.out().print(view.line(one))
    except AbortError:
        console.fail("interrupted; the robot confirmed the stop", code=exit_codes.INTERRUPTED)
    except HangError as error:
        console.fail(str(error), "on a host, this ends the driver, which then stops the motors")
    except NotStoppedError as error:
        console.fail(f"the robot did not confirm the stop: {error}", "switch the robot off")
    except PortError as error:
        console.fail(str(error), "`ls -l /dev/serial/by-id` lists the serial ports")
    return results


@contextmanager
def _signals() -> Iterator[None]:
    """The first signal ends the test in order; later ones are ignored, so that the robot stops."""
    from swarmctl.conformance.bench import AbortError, HangError

    def end(*_: Any) -> None:
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        raise AbortError

    alarms = 0

    def too_long(*_: Any) -> None:
        """A class may catch this, too; the program then ends at once, as a driver does."""
        nonlocal alarms
        alarms += 1
        signal.setitimer(signal.ITIMER_REAL, _NEXT_ALARM)
        if alarms > _MOST_ALARMS:
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
        raise HangError(_HANGS)

    before = {number: signal.signal(number, end) for number in _SIGNALS}
    before[signal.SIGALRM] = signal.signal(signal.SIGALRM, too_long)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _print_summary(name: str, port: Path, results: list[Result], *, json: bool) -> None:
    from swarmctl.conformance.results import passed
    from swarmctl.views import conformance as view

    if json:
        checks = [one.to_json() for one in results]
        console.print_json(
            {"v": 1, "type": name, "port": str(port), "passed": passed(results), "results": checks}
        )
    else:
        console.out().print(f"\n{view.verdict(results)}")
    if not passed(results):
        raise typer.Exit(exit_codes.ERROR)


driver = typer.Typer(
    name="driver", no_args_is_help=True, help="Show robot types, write your own, test a robot with it."
)
for name, verb in (("list", list_), ("show", show), ("new", new), ("test", driver_test)):
    driver.command(name, epilog=exit_codes.epilog())(verb)
