"""``swarmctl firmware``: sketches of boards that swarmctl programs, built and written to the boards."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import access, console, exits

if TYPE_CHECKING:
    from swarmctl.firmware.build import Built
    from swarmctl.render.firmware import Sketch
    from swarmctl.topology.swarm import Robot, Swarm

firmware = typer.Typer(
    name="firmware",
    no_args_is_help=True,
    help="Build the sketch of a robot's board, and write it to the board.",
)

Out = Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder for NAME.hex and NAME.elf.")]
Core = Annotated[
    Path | None,
    typer.Option("--core", metavar="DIR", help="The Arduino core; by default where Debian puts it."),
]
BUILT = Path("build/firmware")


@firmware.command(epilog=exits.told())
def build(
    spec: access.Spec,
    robot: Annotated[str | None, typer.Argument(metavar="ROBOT", help="Only this robot's.")] = None,
    overlays: access.Overlays = None,
    out: Out = BUILT,
    core: Core = None,
    json: access.Json = False,
) -> None:
    """Compile the sketch of every board that swarmctl programs; tell what it takes of flash and RAM."""
    chosen = _chosen(console.read_spec(spec), robot)
    made = {name: (sketch, _built(name, sketch, out, core)) for name, sketch in chosen.items()}
    if json:
        told = [{"robot": name, **_entry(sketch, one)} for name, (sketch, one) in made.items()]
        console.print_json({"v": 1, "firmware": told})
        return
    for name, (sketch, one) in made.items():
        console.out().print(_told(name, sketch, one))


@firmware.command(epilog=exits.told(exits.HOSTS_FAILED, exits.HOSTS_UNREACHABLE))
def flash(
    spec: access.Spec,
    robot: Annotated[str, typer.Argument(metavar="ROBOT", help="The robot whose board it is.")],
    overlays: access.Overlays = None,
    programmer: Annotated[
        str, typer.Option("--programmer", metavar="ID", help="What avrdude speaks to; see `avrdude -c ?`.")
    ] = "arduino",
    speed: Annotated[
        int,
        typer.Option("--speed", metavar="BAUD", min=300, max=4_000_000,
                     help="The boot loader's baud rate: 115200 on an UNO, 57600 on an old Nano."),
    ] = 115_200,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the commands, and run none.")] = False,
    out: Out = BUILT,
    core: Core = None,
    lab: access.Lab = False,
    lab_name: access.LabName = "",
) -> None:  # fmt: skip
    """Build it, bring it to the robot's host, and write it to the board there, while the driver stands aside.

    Afterwards the driver has to hear the board name the new firmware.
    """
    from swarmctl.deploy import flash as flashing
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.remote.transport import HostError
    from swarmctl.topology import names

    swarm = console.read_spec(spec)
    sketch = _chosen(swarm, robot)[robot]
    built = _built(robot, sketch, out, core)
    console.err().print(_told(robot, sketch, built))
    placed = swarm.robots[robot]
    unit, port = names.unit(swarm.name, robot), placed.line.path
    job = flashing.Job(swarm.name, unit, port, built.hex.read_bytes(), sketch.digest, programmer, speed)
    if dry_run:
        for command in job.commands(built.hex.name):
            print(f"{placed.host}: {' '.join(command)}")
        return
    target = access.targets(spec, swarm, lab=lab, lab_name=lab_name)[placed.host]
    result = flashing.flash(job, target, SshTransport(), lambda note: console.err().print(f"  {note}"))
    if isinstance(result, HostError):
        code = exits.HOSTS_FAILED if result.reached else exits.HOSTS_UNREACHABLE
        console.fail(f"{placed.host}: {result.message}", *([result.hint] if result.hint else []), code=code)
    if not result.told:
        console.fail(
            f"the board of `{robot}` was written and read back, but its driver has not heard from it since",
            f"swarmctl status {spec}",
            f"on {placed.host}: journalctl -u {unit}",
            code=exits.HOSTS_FAILED,
        )
    console.out().print(f"{robot}: runs firmware {sketch.digest}")


def simulated(swarm: Swarm) -> dict[str, Path]:
    """What a lab needs to run every sketch of a swarm on a simulated board, by robot."""
    return {name: _wired(swarm.robots[name], sketch) for name, sketch in _chosen(swarm, None).items()}


def _wired(robot: Robot, sketch: Sketch) -> Path:
    """The built sketch of a robot, and the board that it is to run on."""
    from swarmctl.lab.boards import wired
    from swarmctl.lab.emulators.uno import Motor
    from swarmctl.render.firmware import settings_of

    assert robot.type.sketch is not None  # it has a sketch of ours
    values = settings_of(robot, robot.type.sketch).values()
    pins = ("encoder", "enable", "forward", "backward")
    left, right = (
        Motor(**{pin: values[side][pin] for pin in pins}, pulses=values["pulses_per_turn"])
        for side in ("left", "right")
    )
    shape = {key: values[key] for key in ("baud", "wheel_radius", "wheel_separation")}
    return wired(_built(robot.name, sketch, BUILT, None).hex, **shape, left=left, right=right)


def _chosen(swarm: Swarm, robot: str | None) -> dict[str, Sketch]:
    """The sketches of the robots that have one of ours, or of ``robot`` alone."""
    from swarmctl.render.firmware import sketch_of
    from swarmctl.spec.suggest import did_you_mean

    if robot is not None and robot not in swarm.robots:
        console.fail(
            f"there is no robot called `{robot}`", *did_you_mean(robot, swarm.robots, "the robots are")
        )
    wanted = swarm.robots if robot is None else {robot: swarm.robots[robot]}
    found = {name: sketch for name, one in wanted.items() if (sketch := sketch_of(one)) is not None}
    if not found:
        who = f"robot `{robot}`" if robot else "no robot of this swarm"
        console.fail(
            f"{who} has {'no' if robot else 'a'} board that swarmctl programs",
            "a type with `protocol: {kind: rosserial, firmware: uno-l298n}` has one, like arduino-rover",
        )
    return found


def _built(name: str, sketch: Sketch, out: Path, core: Path | None) -> Built:
    from swarmctl.firmware import build as building
    from swarmctl.firmware import toolchain

    try:
        return building.build(name, sketch.sources, out, toolchain.find(core))
    except toolchain.FirmwareError as error:
        console.fail(str(error), *error.help_lines)
    except OSError as error:
        console.fail(
            f"cannot write {error.filename or out}: {error.strerror or error}", "choose another --out"
        )


def _told(name: str, sketch: Sketch, one: Built) -> str:
    from swarmctl.firmware.build import FLASH, RAM

    return (
        f"{name}: {one.hex}, firmware {sketch.digest}\n"
        f"  flash {one.flash} of {FLASH} B ({one.flash / FLASH:.0%})\n"
        f"  RAM   {one.ram} of {RAM} B ({one.ram / RAM:.0%}): data {one.data} B, stack at most {one.stack} B"
    )


def _entry(sketch: Sketch, one: Built) -> dict[str, Any]:
    return {
        "digest": sketch.digest,
        "hex": str(one.hex),
        "elf": str(one.elf),
        "flash": one.flash,
        "data": one.data,
        "stack": one.stack,
    }
