"""The programs of a host: launch files, parameters, units; scripts for people at a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from swarmctl.render import shipped_files
from swarmctl.render.bundle import File, Unit, package
from swarmctl.render.quoting import render
from swarmctl.render.ros1.release import ROS_CLIENT, RUNNING, home, ros_client, service_values
from swarmctl.render.yaml_params import params_file
from swarmctl.swarm import names
from swarmctl.swarm.resolved import Host, Program, Swarm
from swarmctl.swarm.shipped_programs import INTERACTIVE, SCRIPTS
from swarmctl.swarm.topics import COMMAND

_HAS_PACKAGES = "bin/has-packages"
_TELEOP = "teleop"


def files(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields what the programs of ``host`` need, their units aside."""
    programs = swarm.programs_on(host.name)
    if programs:
        yield ros_client()
    if any(_packages(one) for one in programs if one.declared.optional):
        yield File(_HAS_PACKAGES, shipped_files.text("host/has-packages"), 0o755)
    if any(one.declared.use for one in programs):
        yield from shipped_files.folder(_TELEOP)
    for program in programs:
        origin = f"programs.{program.name}"
        if program.declared.use is None:
            yield File(_launch_path(program), _launch(swarm, program), origin=origin)
        if program.declared.use is not None or _has_parameter_file(program):
            yield File(_params_path(program), parameters(program), origin=origin)


def terminal_scripts(swarm: Swarm, host: Host) -> Iterator[File]:
    """Yields a script for each program of ``host`` that a person starts at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.declared.use in INTERACTIVE:
            text = render("interactive.bash", home=home(swarm), command=_command(swarm, program))
            yield File(f"bin/{program.name}", text, 0o755, f"programs.{program.name}")


def units(swarm: Swarm, host: Host) -> Iterator[tuple[File, Unit]]:
    """Yields a unit for each program of ``host`` that runs without a person at a terminal."""
    for program in swarm.programs_on(host.name):
        if program.runs_by_itself:
            yield _unit(swarm, host, program)


def requires(swarm: Swarm, host: Host) -> tuple[str, ...]:
    """Returns what must be installed for the programs that the swarm is not complete without."""
    programs = swarm.programs_on(host.name)
    found = [package(name) for one in programs if not one.declared.optional for name in _packages(one)]
    ours = ["rospy"] if any(one.declared.use for one in programs) else []
    return tuple(dict.fromkeys([*ours, *found]))


def parameters(program: Program) -> bytes:
    """Returns a program's private parameters; those of a shipped one have its node and robots, too."""
    data: dict[str, Any] = dict(program.declared.params)
    if program.declared.use is not None:
        robots = program.commands
        data = {
            "node": program.node,
            "targets": [{"robot": one, "topic": f"{names.namespace(one)}/{COMMAND}"} for one in robots],
            "params": data,
        }
    return params_file(data)


def _launch(swarm: Swarm, program: Program) -> bytes:
    declared = program.declared
    return render(
        "program.launch",
        home=home(swarm),
        program=program.name,
        group=program.node.rpartition("/")[0][1:],
        node=program.node.rpartition("/")[2],
        package=declared.package,
        executable=declared.executable,
        launch=declared.launch,
        params=list(declared.params.items()),
        remap=list(declared.remap.items()),
        environment=list(declared.environment.items()),
    )


def _unit(swarm: Swarm, host: Host, program: Program) -> tuple[File, Unit]:
    name = names.unit(swarm.name, program.name)
    packages = _packages(program) if program.declared.optional else ()
    text = render(
        "program.service",
        **service_values(swarm),
        program=program.name,
        packages=packages,
        command=_command(swarm, program),
        runtime=names.runtime_folder(swarm.name, program.name),
        memory_mb=program.declared.memory_mb,
        shipped=program.declared.use is not None,
        user=host.user,
    )
    file = File(f"units/{name}", text, origin=f"programs.{program.name}")
    needs = [file.path, *RUNNING, ROS_CLIENT, *_reads(program)]
    if packages:
        needs.append(_HAS_PACKAGES)
    return file, Unit(name, tuple(needs), program=program.name, packages=packages)


def _command(swarm: Swarm, program: Program) -> tuple[str, ...]:
    """What `ros-client` runs."""
    current, declared = f"{home(swarm)}/current", program.declared
    if declared.use is None:
        return ("roslaunch", "--wait", "--screen", "--disable-title", f"{current}/{_launch_path(program)}")
    environment = [f"{key}={value}" for key, value in declared.environment.items()]
    namespace, _, node = program.node.rpartition("/")
    return (
        *(["/usr/bin/env", *environment] if environment else []),
        "/usr/bin/python3", f"{current}/{_TELEOP}/{SCRIPTS[declared.use]}",
        "--config", f"{current}/{_params_path(program)}",
        f"__ns:={namespace or '/'}", f"__name:={node}",
        *(f"{old}:={new}" for old, new in declared.remap.items()),
    )  # fmt: skip


def _reads(program: Program) -> Iterator[str]:
    """The files whose change restarts a program."""
    if program.declared.use is None:
        yield _launch_path(program)
    else:
        yield from (file.path for file in shipped_files.folder(_TELEOP))
    if program.declared.use is not None or _has_parameter_file(program):
        yield _params_path(program)


def _packages(program: Program) -> tuple[str, ...]:
    declared = program.declared
    return tuple(dict.fromkeys([*([declared.package] if declared.package else []), *declared.requires]))


def _has_parameter_file(program: Program) -> bool:
    """A node's parameters stand in a file, whose text roslaunch leaves alone; a launch file has arguments."""
    return bool(program.declared.params) and program.declared.launch is None


def _launch_path(program: Program) -> str:
    return f"launch/{program.name}.launch"


def _params_path(program: Program) -> str:
    return f"params/{program.name}.yaml"
