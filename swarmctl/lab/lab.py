"""A lab from up to down, and what can be done to it in between."""

from __future__ import annotations

import os
import shutil
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from ipaddress import ip_address, ip_interface
from pathlib import Path
from typing import Any

from swarmctl.lab import control, disks, image, launch, machines, network, places, processes
from swarmctl.lab.emulated import OWN, robot_of
from swarmctl.lab.emulators.own import OwnRobotError
from swarmctl.lab.errors import LabError
from swarmctl.lab.places import Home, home
from swarmctl.lab.plan import LabHost, LabPlan, LabRobot
from swarmctl.lab.state import State, read_state, write_state

BOOT_PATIENCE = 90.0

Say = Callable[[str], None]


@dataclass(frozen=True)
class Operator:
    """Where and as whom swarmctl meets the hosts of a lab. ``keys`` are their pinned public host keys."""

    name: str
    namespace: Path
    identity: Path
    known_hosts: Path
    keys: Mapping[str, tuple[str, ...]]


def up(plan: LabPlan, say: Say) -> None:
    """Bring up whatever of ``plan`` is not up yet, and wait until every host answers SSH."""
    processes.require("ip", "mount", "setpriv", "ssh", "ssh-keygen", "systemd-nspawn", "unshare")
    for robot in plan.robots:
        _try_emulator(robot)
    place = home(plan.name)
    _require_cgroups(place)
    if not place.state.exists():
        with _step(say, "image") as note:
            note(str(image.ensured(lambda line: say(f"  image: {line}"))))
    with places.locked(place.directory):
        state = _settle(place, plan)
        if report := launch.asked(place):
            dark = [host.name for host in plan.hosts if report["hosts"][host.name]["state"] == "stopped"]
            say(f"lab {plan.name} is up" + (f"; switching on {', '.join(dark)}" if dark else " already"))
            _mend(place, plan, dark)
        else:
            launch.allow_inotify(say)
            with _step(say, "disks") as note:
                note(f"{_prepared(place, state)} of {len(plan.hosts)} new")
            with _step(say, "network") as note:
                network.remove(place)
                network.create(plan, place)
                note(", ".join(f"{one.name} {one.subnet}" for one in plan.networks))
            with _step(say, "supervisor"):
                launch.launch(place)
            if workspace := state.plan.workspace:
                say(f"workspace: {workspace.space} is {workspace.place} on every host")
        _await_hosts(place, plan, say, since=time.monotonic())
    for robot in plan.robots:
        say(_line_of(robot))


def _mend(place: Home, plan: LabPlan, dark: Sequence[str]) -> None:
    """Undo what ``kill``, ``cut`` and ``unplug`` have done."""
    for name in dark:
        control.ask(place.socket, {"do": "start", "what": name})
    for host in plan.hosts:
        network.set_cable(plan, place, host.name, up=True)
    for robot in plan.robots:
        if robot.emulator:
            control.ask(place.socket, {"do": "plug", "what": robot.name})


def _line_of(robot: LabRobot) -> str:
    if not robot.emulator:
        return f"robot {robot.name}: no emulator for type {robot.type}; {robot.device} stays absent"
    radio = (
        " (no radio here: the device is bound already, the unit that binds it is not needed)"
        if robot.bluetooth
        else ""
    )
    own = f", emulated by {robot.emulator}" if robot.emulator.endswith(OWN) else ""
    return f"robot {robot.name}: {robot.type} on {robot.device}{own}{radio}"


def _try_emulator(robot: LabRobot) -> None:
    """A mistake in an emulator of one's own is told before anything boots."""
    try:
        if robot.emulator:
            robot_of(robot.emulator)
    except OwnRobotError as error:
        raise LabError(f"robot {robot.name} has no emulator: {error}") from None


def down(name: str) -> bool:
    """Remove everything of a lab, whatever state it is in; whether there was anything."""
    processes.require("ip")
    place = home(name)
    if not place.directory.exists() and not place.namespaces():
        return False
    with places.locked(place.directory):
        launch.end(place)
        processes.kill(processes.in_network_namespaces(places.NAMESPACES / one for one in place.namespaces()))
        network.remove(place)
        for tree in _cgroups(place).all:
            machines.drop_cgroup(tree)
        shutil.rmtree(place.directory)
    return True


def status(name: str) -> dict[str, Any]:
    """Hosts, robots and networks of a lab as they are now."""
    place = home(name)
    plan = read_state(place).plan
    report = launch.asked(place)
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
        "networks": _network_status(place, plan) if report else [],
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


def _network_status(place: Home, plan: LabPlan) -> list[dict[str, Any]]:
    whole = network.cables(plan, place)
    return [
        {
            "name": one.name,
            "kind": one.kind,
            "subnet": one.subnet,
            "operator": one.operator,
            "hosts": {host: up for (host, attached), up in whole.items() if attached == one.name},
        }
        for one in plan.networks
    ]


def robots(name: str) -> dict[str, dict[str, Any]]:
    """The true state of every emulated robot: pose in m and rad, wheel speeds in m/s, plugged or not."""
    found: dict[str, dict[str, Any]] = _running(name)["robots"]
    return found


def plug(name: str, robot: str) -> None:
    _command(name, "plug", read_state(home(name)).plan.robot(robot).name)


def unplug(name: str, robot: str) -> None:
    """Pull a robot's cable: the device vanishes from its host, the robot goes on as last told."""
    _command(name, "unplug", read_state(home(name)).plan.robot(robot).name)


def cut(name: str, host: str, link: str | None = None) -> tuple[str, ...]:
    """Cut a host off its networks, or off one of them. Gives the networks concerned."""
    return _set_cable(name, host, link, up=False)


def join(name: str, host: str, link: str | None = None) -> tuple[str, ...]:
    return _set_cable(name, host, link, up=True)


def _set_cable(name: str, host: str, link: str | None, *, up: bool) -> tuple[str, ...]:
    _running(name)
    place = home(name)
    return network.set_cable(read_state(place).plan, place, host, up=up, network=link)


def kill(name: str, host: str) -> None:
    """Cut a host's power and wait until it is dark. Its disk stays as it is."""
    _command(name, "kill", read_state(home(name)).plan.host(host).name)
    deadline = time.monotonic() + BOOT_PATIENCE
    while _running(name)["hosts"][host]["state"] != "stopped":
        if time.monotonic() > deadline:
            raise LabError(f"host {host} does not go down")
        time.sleep(0.02)


def start(name: str, host: str, say: Say) -> None:
    """Switch a host on and wait until it answers SSH."""
    place = home(name)
    plan = read_state(place).plan
    _command(name, "start", plan.host(host).name)
    only = LabPlan(plan.name, plan.swarm, (plan.host(host),), plan.networks, ())
    _await_hosts(place, only, say, since=time.monotonic())


def operator(name: str) -> Operator:
    """How to reach the hosts of a lab that is up: ``network.enter`` its namespace, use its identity."""
    place = home(name)
    plan = read_state(place).plan
    _running(name)
    return Operator(
        name=name,
        namespace=network.namespace_path(place),
        identity=place.identity,
        known_hosts=place.known_hosts,
        keys={host.name: (_public_key(place, host.name),) for host in plan.hosts},
    )


def ssh_argv(name: str, host: str, command: Sequence[str] = ()) -> tuple[str, ...]:
    """The ssh command for a host of the lab. It only makes sense after ``network.enter``."""
    place = home(name)
    target = read_state(place).plan.host(host)
    options = {
        "IdentitiesOnly": "yes",
        "IdentityFile": str(place.identity),
        "UserKnownHostsFile": str(place.known_hosts),
        "GlobalKnownHostsFile": "/dev/null",
        "HostKeyAlias": host,
        "StrictHostKeyChecking": "yes",
        "LogLevel": "ERROR",
    }
    spelled = [word for key, value in options.items() for word in ("-o", f"{key}={value}")]
    return (
        "ssh",
        "-F",
        "/dev/null",
        *spelled,
        "-p",
        str(target.port),
        f"{target.user}@{target.address}",
        *command,
    )


def _settle(place: Home, plan: LabPlan) -> State:
    """The state that the lab has or, from now on, will have. Refuses to turn one lab into another."""
    if place.state.exists():
        state = read_state(place)
        if state.plan != replace(plan, workspace=plan.workspace or state.plan.workspace):
            raise LabError(
                f"lab {plan.name} is up with other hosts, links or robots, or another workspace",
                "take it down first (`swarmctl lab down`), or give this one a name of its own (--name)",
            )
        if not state.image.is_dir():
            raise LabError(
                f"the image {state.image} of lab {plan.name} is gone", "run `swarmctl lab down`, then `up`"
            )
        return state
    state = State(plan, image.ensured(lambda _: None))
    write_state(place, state)
    return state


def _prepared(place: Home, state: State) -> int:
    """Make keys and disks where they are missing; how many disks were."""
    public = place.identity.with_suffix(".pub")
    if not public.exists():  # it is written last
        place.identity.unlink(missing_ok=True)
        disks.generate_key(place.identity, f"swarmctl lab {place.name}")
    place.hosts.mkdir(exist_ok=True)
    authorized = public.read_text()

    def prepare(host: LabHost) -> bool:
        return disks.prepare(host, place.host(host.name), state.image, authorized, state.plan.workspace)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        fresh = sum(pool.map(prepare, state.plan.hosts))
    lines = (f"{host.name} {_public_key(place, host.name)}\n" for host in state.plan.hosts)
    place.known_hosts.write_text("".join(lines))
    return fresh


def _public_key(place: Home, host: str) -> str:
    """Type and key, without the comment."""
    return " ".join(place.host(host).host_key.read_text().split()[:2])


def _await_hosts(place: Home, plan: LabPlan, say: Say, *, since: float) -> None:
    """Wait until the systemd of every host has started and its sshd greets, and say so host by host."""
    waiting = {host.name: host for host in plan.hosts}
    cut_off = _cut_off(place)
    while waiting:
        report = _running(place.name)["hosts"]
        for host in [host for name, host in waiting.items() if report[name]["state"] == "running"]:
            if host.name in cut_off:
                del waiting[host.name]
                say(f"host {host.name}: it is on, and cut off the network of its address")
            elif _greets(place, host):
                del waiting[host.name]
                say(f"host {host.name}: {host.address} answers SSH  {time.monotonic() - since:.1f} s")
        for host in waiting.values():
            if not report[host.name]["wanted"]:
                said = launch.last_lines(place.host(host.name).log)
                raise LabError(
                    f"host {host.name} did not start: exit status {report[host.name]['exit']}", *said
                )
        if waiting and time.monotonic() - since > BOOT_PATIENCE:
            raise LabError(f"after {BOOT_PATIENCE:.0f} s these hosts do not answer: {', '.join(waiting)}")
        if waiting:
            time.sleep(0.05)


def _cut_off(place: Home) -> set[str]:
    """The hosts that cannot be reached at their addresses, because ``cut`` saw to it."""
    plan = read_state(place).plan
    whole = network.cables(plan, place)
    return {
        host.name
        for host in plan.hosts
        for interface in host.interfaces
        if ip_interface(interface.address).ip == ip_address(host.address)
        and not whole[host.name, interface.network]
    }


def _greets(place: Home, host: LabHost) -> bool:
    def greeting() -> bytes:
        with socket.create_connection((host.address, host.port), timeout=1.0) as connection:
            return connection.recv(4)

    try:
        return network.within(network.namespace_path(place), greeting) == b"SSH-"
    except OSError:
        return False


def _running(name: str) -> dict[str, Any]:
    place = home(name)
    read_state(place)
    report = launch.asked(place)
    if report is None:
        raise _dark(name)
    return report


def _dark(name: str) -> LabError:
    return LabError(
        f"lab {name} is not running", "run `swarmctl lab up` to start it again, `lab down` to remove it"
    )


def _command(name: str, verb: str, subject: str) -> None:
    try:
        control.ask(home(name).socket, {"do": verb, "what": subject})
    except OSError:
        raise _dark(name) from None


def _cgroups(place: Home) -> machines.Cgroups:
    own, mounts = Path("/proc/self/cgroup").read_text(), Path("/proc/self/mountinfo").read_text()
    return machines.cgroups(mounts, own, place.tag, delegated=False)


def _require_cgroups(place: Home) -> None:
    if not _cgroups(place).all:
        raise LabError(
            "no cgroups that systemd could use are mounted here", "mount -t cgroup2 none /sys/fs/cgroup"
        )


@contextmanager
def _step(say: Say, title: str) -> Iterator[Callable[[str], None]]:
    """One line for one step, with how long it took; the step may add what it found."""
    notes: list[str] = []
    began = time.monotonic()
    yield notes.append
    say(f"{title}: {' '.join(notes) or 'ready'}  {time.monotonic() - began:.1f} s")
