"""The commands of a lab: up, down, status, and faults and their repair."""

from __future__ import annotations

import os
import shlex
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from swarmctl.lab import paths, preparation, supervisor_client
from swarmctl.lab.driver_stand_ins import StandIn, is_ros2
from swarmctl.lab.emulators.emulator_lookup import EMULATOR_SUFFIX
from swarmctl.lab.faults import host_faults, kinds
from swarmctl.lab.faults.fault_kind import RunningLab, running_lab
from swarmctl.lab.hosts import network, nspawn, processes
from swarmctl.lab.lab_plan import LabHost, LabPlan, LabRobot
from swarmctl.lab.lab_state import State, read_state
from swarmctl.lab.paths import LabPaths, lab_paths
from swarmctl.lab.preparation import wait_for_hosts
from swarmctl.render.bundle import ROOT
from swarmctl.yamltext import hostlist


def setup_file(swarm: str) -> str:
    """Returns the path on every host of the file that sets up the ROS of ``swarm``."""
    return f"{ROOT}/{swarm}/current/setup.bash"


def operator_argv(command: Sequence[str], shell: str) -> tuple[str, ...]:
    """Returns what runs for the operator; a single text is a line for ``shell``, as hosts take it."""
    if not command:
        return (shell,)
    return tuple(command) if len(command) > 1 else (shell, "-c", command[0])


def host_line(setup: str, command: Sequence[str]) -> str:
    """Returns the line that a host's shell runs: the file ``setup`` if it is there, then ``command``.

    Without a command it opens a shell.
    """
    line = " ".join(command) or 'exec "$SHELL"'
    return f"[ ! -r {shlex.quote(setup)} ] || . {shlex.quote(setup)}; {line}"


Progress = Callable[[str], None]


@dataclass(frozen=True)
class Operator:
    """How swarmctl connects to the hosts of a lab: their addresses and their public host keys."""

    name: str
    swarm: str
    namespace: Path
    identity: Path
    known_hosts: Path
    keys: Mapping[str, tuple[str, ...]]
    addresses: Mapping[str, str]


def up(plan: LabPlan, progress: Progress) -> None:
    """Starts what is not running of ``plan`` and waits until every host answers SSH.

    ``progress`` gets a line per step. Raises ``LabError``.
    """
    os.umask(0o022)  # of what hosts have, whatever the operator's is
    processes.require("ip", "mount", "setpriv", "ssh", "ssh-keygen", "systemd-nspawn", "unshare")
    for robot in plan.robots:
        preparation.check_emulator(robot)
    files = lab_paths(plan.name)
    preparation.require_cgroups(files)
    if not files.state.exists():
        with _step(progress, "image") as note:
            images = preparation.images_of(plan, lambda line: progress(f"  image: {line}"))
            note(", ".join(dict.fromkeys(map(str, images.values()))))
    with paths.locked(files.directory):
        state = preparation.load_or_create(files, plan)
        if report := supervisor_client.status(files):
            stopped = [host.name for host in plan.hosts if report["hosts"][host.name]["state"] == "stopped"]
            starting = f"; starting {hostlist.written(stopped)}" if stopped else " already"
            progress(f"lab {plan.name} is up{starting}")
            kinds.end_all(RunningLab(plan, files), *_all_of(plan))
        else:
            supervisor_client.allow_inotify(progress)
            with _step(progress, "disks") as note:
                note(f"{preparation.prepare_disks(files, state)} of {len(plan.hosts)} new")
            with _step(progress, "network") as note:
                network.remove(files)
                network.create(plan, files)
                note(", ".join(f"{one.name} {one.subnet}" for one in plan.networks))
            with _step(progress, "supervisor"):
                supervisor_client.launch(files)
            if workspace := state.plan.workspace:
                progress(f"workspace: {workspace.space} is {workspace.place} on every host")
        wait_for_hosts(files, plan, progress, since=time.monotonic())
    for line in robot_lines(plan, state):
        progress(line)


def robot_lines(plan: LabPlan, state: State) -> Iterator[str]:
    """How each robot is there; robots of which the same is true share a line."""
    standing = {one.robot for one in plan.stand_ins}
    emulated: dict[tuple[str, ...], list[LabRobot]] = {}
    for robot in plan.robots:
        if robot.name not in standing:
            emulated.setdefault(_emulation(robot), []).append(robot)
    for (before, after), robots in emulated.items():
        devices = hostlist.written(robot.device for robot in robots)
        yield f"robot {hostlist.written(robot.name for robot in robots)}: {before}{devices}{after}"
    yield from stand_in_lines(plan, state)


def stand_in_lines(plan: LabPlan, state: State) -> Iterator[str]:
    """Which robots a stand-in drives, in place of which package, or where the lab has that."""
    replaced: dict[str, list[str]] = {}
    for one in plan.stand_ins:
        replaced.setdefault(_stand_in(one, state), []).append(one.robot)
    for what, names in replaced.items():
        yield f"robot {hostlist.written(names)}: {what}"


def _emulation(robot: LabRobot) -> tuple[str, str]:
    """What stands before and after the device of a robot."""
    if not robot.emulator:
        return f"no emulator for type {robot.type}; nothing at ", ""
    radio = (
        " (no Bluetooth in a lab: the device exists, its rfcomm unit is not needed)"
        if robot.bluetooth
        else ""
    )
    file = f", emulated by {robot.emulator}" if robot.emulator.endswith(EMULATOR_SUFFIX) else ""
    return f"{robot.type} on ", f"{file}{radio}"


def _stand_in(one: StandIn, state: State) -> str:
    if place := state.installed_in(one.host, one.package):
        return f"{one.starter} is in {place}"
    replaced = ", ".join((one.starter, *state.lacking(one)))
    lost = ", ".join(state.missing_messages(one))
    then = (
        "its topics are left out"
        if is_ros2(state.plan.host(one.host).distro)
        else "messages of it are not shown: they are empty"
    )
    without = f"; the lab lacks {lost}, so {then}" if lost else ""
    return f"a stand-in moves and publishes in place of {replaced}{without}"


def _all_of(plan: LabPlan) -> tuple[list[str], list[str]]:
    """The names of the hosts and the robots of a lab."""
    return [host.name for host in plan.hosts], [robot.name for robot in plan.robots]


def down(name: str) -> bool:
    """Removes everything of a lab, whatever its state. Returns whether anything existed."""
    processes.require("ip")
    files = lab_paths(name)
    if not files.directory.exists() and not files.namespaces():
        return False
    with paths.locked(files.directory):
        supervisor_client.stop(files)
        processes.kill(processes.in_network_namespaces(paths.NAMESPACES / one for one in files.namespaces()))
        network.remove(files)
        for tree in preparation.cgroups(files).all:
            nspawn.remove_cgroup(tree)
        shutil.rmtree(files.directory)
    return True


def status(name: str) -> dict[str, Any]:
    """Returns the current state of hosts, robots and networks, as ``lab status --json`` prints it."""
    files = lab_paths(name)
    plan = read_state(files).plan
    report = supervisor_client.status(files)
    return {
        "name": plan.name,
        "swarm": plan.swarm,
        "running": report is not None,
        "hosts": [_host_status(host, report) for host in plan.hosts],
        "robots": [
            {
                "name": robot.name,
                "type": robot.type,
                "host": robot.host,
                "device": robot.device,
                "plugged": bool(report and report["robots"].get(robot.name, {}).get("plugged")),
            }
            for robot in plan.robots
        ],
        "networks": _network_status(files, plan) if report else [],
    }


def _host_status(host: LabHost, report: Mapping[str, Any] | None) -> dict[str, Any]:
    found = report["hosts"][host.name] if report else {"state": "stopped", "boots": 0, "since": None}
    return {
        "name": host.name,
        "address": host.address,
        "user": host.user,
        "state": found["state"],
        "boots": found["boots"],
        "since": found["since"],
    }


def _network_status(files: LabPaths, plan: LabPlan) -> list[dict[str, Any]]:
    connected = network.link_states(plan, files)
    return [
        {
            "name": one.name,
            "kind": one.kind,
            "subnet": one.subnet,
            "operator": one.operator,
            "hosts": {host: up for (host, attached), up in connected.items() if attached == one.name},
        }
        for one in plan.networks
    ]


def robots(name: str) -> dict[str, dict[str, Any]]:
    """Returns the true state of every emulated robot: pose (m, rad), wheel speeds (m/s), plugged or not."""
    found: dict[str, dict[str, Any]] = supervisor_client.running(lab_paths(name))["robots"]
    return found


def plug(name: str, robot: str) -> None:
    """Connects a robot's cable: its device appears on the host."""
    supervisor_client.command(lab_paths(name), "plug", read_state(lab_paths(name)).plan.robot(robot).name)


def unplug(name: str, robot: str) -> None:
    """Disconnects a robot's cable: its device disappears, the robot keeps executing its last command."""
    supervisor_client.command(lab_paths(name), "unplug", read_state(lab_paths(name)).plan.robot(robot).name)


def cut(name: str, host: str, link: str | None = None) -> tuple[str, ...]:
    """Disconnects a host from all its networks, or from ``link``. Returns the names of these networks."""
    return _set_cable(name, host, link, up=False)


def join(name: str, host: str, link: str | None = None) -> tuple[str, ...]:
    """Reverts ``cut``. Returns the names of the networks."""
    return _set_cable(name, host, link, up=True)


def _set_cable(name: str, host: str, link: str | None, *, up: bool) -> tuple[str, ...]:
    supervisor_client.running(lab_paths(name))
    files = lab_paths(name)
    return network.set_cable(read_state(files).plan, files, host, up=up, network=link)


def kill(name: str, host: str) -> None:
    """Cuts a host's power and waits until it has stopped. Its disk is kept. Raises ``LabError``."""
    host_faults.power_off(running_lab(name), host)


def start(name: str, hosts: Sequence[str], progress: Progress) -> None:
    """Boots hosts and waits until they answer SSH."""
    lab, since = running_lab(name), time.monotonic()
    host_faults.power_on(lab, [lab.plan.host(host).name for host in hosts])
    _wait_for(lab, hosts, progress, since)


def fault(name: str, kind: str, target: str, value: Any = None) -> str:
    """Begins a fault of a kind (``kinds.KINDS``) at a host or a robot. Returns what is true of it now.

    ``value`` is that of the kind's option. Raises ``LabError``.
    """
    return kinds.KINDS[kind].begin(running_lab(name), target, value)


def repair(
    name: str, progress: Progress, hosts: Sequence[str] | None = None, robots: Sequence[str] | None = None
) -> None:
    """Ends all faults of hosts and robots, of all by default, and waits until the hosts answer SSH.

    Raises ``LabError``.
    """
    lab, since = running_lab(name), time.monotonic()
    every = _all_of(lab.plan)
    concerned = every[0] if hosts is None else hosts
    kinds.end_all(lab, concerned, every[1] if robots is None else robots)
    _wait_for(lab, concerned, progress, since)


def _wait_for(lab: RunningLab, hosts: Sequence[str], progress: Progress, since: float) -> None:
    chosen = tuple(lab.plan.host(host) for host in hosts)
    only = LabPlan(lab.plan.name, lab.plan.swarm, chosen, lab.plan.networks, ())
    wait_for_hosts(lab.files, only, progress, since=since)


def plan(name: str) -> LabPlan:
    """Returns the plan that a running lab was booted from. Raises ``LabError`` if it is not up."""
    files = lab_paths(name)
    supervisor_client.running(files)
    return read_state(files).plan


def stand_ins(name: str) -> tuple[str, ...]:
    """Returns which robots of a lab a stand-in drives. Raises ``LabError`` if there is no such lab."""
    state = read_state(lab_paths(name))
    return tuple(stand_in_lines(replace(state.plan, stand_ins=state.stand_ins), state))


def operator(name: str) -> Operator:
    """Returns how to reach the hosts of a running lab, from inside its namespace (``network.enter``)."""
    files = lab_paths(name)
    plan = read_state(files).plan
    supervisor_client.running(lab_paths(name))
    return Operator(
        name=name,
        swarm=plan.swarm,
        namespace=network.namespace_path(files),
        identity=files.identity,
        known_hosts=files.known_hosts,
        keys={host.name: (preparation.public_key(files, host.name),) for host in plan.hosts},
        addresses={host.name: host.address for host in plan.hosts},
    )


def ssh_argv(name: str, host: str, command: Sequence[str] = (), *, terminal: bool = False) -> tuple[str, ...]:
    """Returns the ssh command for a host. Run it inside the lab's namespace (``network.enter``)."""
    files = lab_paths(name)
    target = read_state(files).plan.host(host)
    options = {
        "IdentitiesOnly": "yes",
        "IdentityFile": str(files.identity),
        "UserKnownHostsFile": str(files.known_hosts),
        "GlobalKnownHostsFile": "/dev/null",
        "HostKeyAlias": host,
        "StrictHostKeyChecking": "yes",
        "LogLevel": "ERROR",
    }
    options_argv = [word for key, value in options.items() for word in ("-o", f"{key}={value}")]
    return (
        "ssh",
        "-F",
        "/dev/null",
        *options_argv,
        *(["-t"] if terminal else []),
        "-p",
        str(target.port),
        f"{target.user}@{target.address}",
        *command,
    )


@contextmanager
def _step(progress: Progress, title: str) -> Iterator[Callable[[str], None]]:
    """Reports one line per step, with its duration; the step may append notes."""
    notes: list[str] = []
    began = time.monotonic()
    yield notes.append
    progress(f"{title}: {' '.join(notes) or 'ready'}  {time.monotonic() - began:.1f} s")
