"""``swarmctl firmware``: builds the sketches of boards and writes them to the boards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import complete, console, exit_codes, next_command, options, selected
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.deploy.flash import Job
    from swarmctl.firmware.compiler import Built
    from swarmctl.remote.transport import Target
    from swarmctl.render.sketch import Sketch
    from swarmctl.swarm.resolved import Robot, Swarm

firmware = typer.Typer(
    name="firmware",
    no_args_is_help=True,
    help="Build the sketch of a robot's board and write it to the board.",
)

Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder for NAME.hex and NAME.elf.")]
Core = Annotated[
    Path | None,
    typer.Option("--core", metavar="DIR", help="The Arduino core; by default that of Debian."),
]
Robots = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="ROBOT",
        help="Only the boards of these robots: rover-*, @group, !rover-3.",
        autocompletion=complete.robots,
    ),
]
BUILT = Path("build/firmware")
PROGRAMMER = "arduino"  # the boot loader on a board's serial line, STK500 version 1
SPEED = 115_200  # an UNO's boot loader; old ones have 57 600


@firmware.command(epilog=exit_codes.epilog())
def build(
    spec: options.Spec,
    robots: Robots = None,
    overlays: options.Overlays = None,
    out: Out = BUILT,
    core: Core = None,
    json: options.Json = False,
) -> None:
    """Compile the sketch of every board that swarmctl programs; print its use of flash and RAM."""
    from swarmctl.views import firmware as view

    chosen = _chosen(console.read_spec(spec), robots or [])
    made = {name: (sketch, _built(name, sketch, out, core)) for name, sketch in chosen.items()}
    if json:
        firmwares = [{"robot": name, **_entry(sketch, one)} for name, (sketch, one) in made.items()]
        console.print_json({"v": 1, "firmware": firmwares})
        return
    for name, (sketch, one) in made.items():
        console.out().print(view.built(name, sketch.digest, one))
    next_command.advise("firmware flash", spec, *(robots or []))


@firmware.command(epilog=exit_codes.epilog(exit_codes.HOSTS_FAILED, exit_codes.HOSTS_UNREACHABLE))
@with_where()
def flash(
    where: Where,
    robots: Robots = None,
    programmer: Annotated[
        str, typer.Option("--programmer", metavar="ID", help="The programmer; see `avrdude -c ?`.")
    ] = PROGRAMMER,
    speed: Annotated[
        int,
        typer.Option("--speed", metavar="BAUD", min=300, max=4_000_000,
                     help="The boot loader's baud rate: 115200 on an UNO, 57600 on an old Nano."),
    ] = SPEED,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Build it and print the next steps.")
    ] = False,
    out: Out = BUILT,
    core: Core = None,
    stop_robots: options.StopRobots = False,
) -> None:  # fmt: skip
    """Build the sketch, copy it to the robot's host and write it to the board. The driver is stopped.

    Afterwards checks that the driver receives the digest of the new firmware from the board.
    """
    from swarmctl.views import firmware as view

    swarm = console.read_spec(where.spec)
    jobs = []
    for name, sketch in _chosen(swarm, robots or []).items():
        made = _built(name, sketch, out, core)
        (console.out() if dry_run else console.err()).print(view.built(name, sketch.digest, made))
        jobs.append(_job(swarm, name, sketch, made, programmer, speed))
    if dry_run:
        for job in jobs:
            host = swarm.hosts[job.host]
            print(view.steps(job, f"{host.name} ({host.user}@{host.address})"))
        return
    targets = where.targets(swarm)
    code = _flash(jobs, targets, stop_robots=stop_robots)
    if code == exit_codes.OK:
        hosts = dict.fromkeys(job.host for job in jobs)
        where.limited(next_command.selection(hosts)).advise("status")
    raise typer.Exit(code)


def _job(swarm: Swarm, name: str, sketch: Sketch, made: Built, programmer: str, speed: int) -> Job:
    from swarmctl.deploy.flash import Job
    from swarmctl.firmware import avrdude
    from swarmctl.render.middleware import middleware_at

    robot = swarm.robots[name]
    assert robot.line is not None  # it has a sketch of ours
    port = robot.line.path
    writing = avrdude.writing(name, made.hex.read_bytes(), port, programmer, speed)
    unit = middleware_at(swarm, robot.host).driver(swarm, robot).unit
    return Job(swarm.name, name, robot.host, unit, port, sketch.digest, writing)


def _flash(jobs: Sequence[Job], targets: Mapping[str, Target], *, stop_robots: bool) -> int:
    """Write the boards and print the result of each; returns the exit code."""
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.deploy import flash as flashing
    from swarmctl.remote.parallel_hosts import Finished, Note, interruptible
    from swarmctl.remote.transport import HostError
    from swarmctl.views import firmware as view

    found: dict[str, flashing.Results | HostError] = {}
    with interruptible(lambda text: console.err().print(text)) as stop:
        for event in flashing.flash(
            jobs, targets, transport(), stop, parallel=options.PARALLEL, stop_robots=stop_robots
        ):
            if isinstance(event, Note):
                console.err().print(f"  {event.host}: {event.text}")
            elif isinstance(event, Finished):
                found[event.host] = event.outcome
    results = {job.robot: flashing.result_of(job, found[job.host]) for job in jobs}
    for job in jobs:
        console.out().print(view.verdict(job, results[job.robot]))
    errors = [result for result in results.values() if isinstance(result, HostError)]
    silent = any(
        isinstance(one, flashing.Flashed) and one.runs and not one.reported for one in results.values()
    )
    if stop.requested:
        return exit_codes.INTERRUPTED
    if silent or any(error.reached for error in errors):
        return exit_codes.HOSTS_FAILED
    return exit_codes.HOSTS_UNREACHABLE if errors else exit_codes.OK


def simulated(swarm: Swarm) -> dict[str, Path]:
    """The simulated board, by robot, of every sketch in a swarm, for a lab."""
    return {name: _wired(swarm.robots[name], sketch) for name, sketch in _chosen(swarm, []).items()}


def _wired(robot: Robot, sketch: Sketch) -> Path:
    """The built sketch of a robot and the board it runs on."""
    from swarmctl.lab.emulators.arduino_rover import write_board
    from swarmctl.lab.emulators.uno import Motor
    from swarmctl.render.sketch import settings_of

    settings = settings_of(robot)
    assert settings is not None  # it has a sketch of ours
    values = settings.values()
    pins = ("encoder", "enable", "forward", "backward")
    left, right = (
        Motor(**{pin: values[side][pin] for pin in pins}, pulses=values["pulses_per_turn"])
        for side in ("left", "right")
    )
    shape = {key: values[key] for key in ("baud", "wheel_radius", "wheel_separation")}
    return write_board(_built(robot.name, sketch, BUILT, None).hex, **shape, left=left, right=right)


def _chosen(swarm: Swarm, robots: Sequence[str]) -> dict[str, Sketch]:
    """The sketches of the selected robots, or of all that have one; exits if a named robot has none."""
    from swarmctl.render.sketch import sketch_of

    wanted = {name: swarm.robots[name] for name in selected.robots(swarm.candidates, robots, "ROBOT")}
    found = {name: sketch for name, one in wanted.items() if (sketch := sketch_of(one)) is not None}
    without = [name for name in robots if name in swarm.robots and name not in found]
    if without or not found:
        who = f"robot `{without[0]}` has no" if without else "no robot of this swarm has a"
        console.fail(
            f"{who} board that swarmctl programs",
            "a type with `protocol: {kind: rosserial, firmware: uno-l298n}` has one, like arduino-rover",
        )
    return found


def _built(name: str, sketch: Sketch, out: Path, core: Path | None) -> Built:
    from swarmctl.firmware import compiler
    from swarmctl.firmware import compiler as building

    try:
        return building.build(name, sketch.sources, out, compiler.find(core))
    except compiler.FirmwareError as error:
        console.fail(str(error), *error.help_lines)
    except OSError as error:
        console.fail(console.cannot_write(error, out), "choose another --out")


def _entry(sketch: Sketch, one: Built) -> dict[str, Any]:
    return {
        "digest": sketch.digest,
        "hex": str(one.hex),
        "elf": str(one.elf),
        "flash": one.flash,
        "data": one.data,
    }
