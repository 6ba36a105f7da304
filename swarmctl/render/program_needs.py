"""What programs and drivers of other packages need on their hosts: ROS packages, engines, secrets."""

from __future__ import annotations

from itertools import chain

from swarmctl.render.bundle import SecretForm, package
from swarmctl.swarm.program_values import secrets_folder
from swarmctl.swarm.resolved import ForeignDriver, Host, Program, Swarm


def of_drivers(swarm: Swarm, host: Host) -> dict[str, tuple[str, ...]]:
    """Returns the packages that the drivers of ``host`` need, each with the entries of its robots."""
    found: dict[str, tuple[str, ...]] = {}
    for robot in swarm.robots_on(host.name):
        packages = robot.driver.ros.packages if isinstance(robot.driver, ForeignDriver) else ()
        for one in (name for name in packages if name not in swarm.packages):
            found[package(one)] = (*found.get(package(one), ()), f"robots.{robot.name}")
    return found


def requires(swarm: Swarm, host: Host, client: str) -> dict[str, tuple[str, ...]]:
    """Returns what must be installed for programs without which the swarm is not complete, and for which.

    ``client``: the library of ROS that shipped programs need.
    """
    found: dict[str, tuple[str, ...]] = {}
    for program in swarm.programs_on(host.name):
        for name in _required(swarm, program, client):
            found[name] = (*found.get(name, ()), f"programs.{program.name}")
    return found


def secret_forms(swarm: Swarm, host: Host) -> dict[str, SecretForm]:
    """Returns the secrets of the programs of ``host``, with what they may hold."""
    declared = [one.declared.secrets for one in swarm.programs_on(host.name)]
    files: dict[str, SecretForm] = {one.secret: "text" for each in declared for one in each.files.values()}
    return {**files, **{one.secret: "line" for each in declared for one in each.env.values()}}


def _required(swarm: Swarm, program: Program, client: str) -> tuple[str, ...]:
    """What must be installed for a program; an optional one is skipped without its packages."""
    ours = (client,) if program.declared.use else ()
    if program.declared.optional:
        return ours
    container = program.declared.container
    engine = (container.engine,) if container is not None else ()
    return (*ours, *engine, *map(package, installed(swarm, program)))


def secret_words(swarm: Swarm, host: Host, program: Program) -> tuple[str, ...]:
    """Returns the arguments of `give-secrets`; none for a program without secrets."""
    secrets = program.declared.secrets
    if not secrets.names:
        return ()
    variables = (("--variable", f"{key}={one.secret}") for key, one in secrets.env.items())
    files = (("--file", f"{name}={one.secret}") for name, one in secrets.files.items())
    owner = "root" if program.declared.container is not None else host.user
    return (
        "--owner", owner, "--source", f"/etc/swarm/{swarm.name}/secrets",
        "--to", secrets_folder(swarm.name, program.name), *chain(*variables, *files),
    )  # fmt: skip


def installed(swarm: Swarm, program: Program) -> tuple[str, ...]:
    """Returns the packages that must lie on the host already."""
    declared = program.declared
    named = dict.fromkeys([*([declared.package] if declared.package else []), *declared.requires])
    return tuple(name for name in named if name not in swarm.packages)
