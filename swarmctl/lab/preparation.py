"""Before and after the supervisor starts: what ``lab up`` checks and creates, and the wait for the hosts."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from ipaddress import ip_address, ip_interface
from pathlib import Path

from swarmctl.lab import supervisor_client
from swarmctl.lab.emulators.emulator_lookup import build_robot
from swarmctl.lab.emulators.user_robot import UserRobotError
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import disks, image, network, nspawn
from swarmctl.lab.lab_plan import LabHost, LabPlan, LabRobot
from swarmctl.lab.lab_state import State, read_state, write_state
from swarmctl.lab.paths import LabPaths, last_lines
from swarmctl.yamltext import hostlist


def check_emulator(robot: LabRobot) -> None:
    """Builds the robot's emulator once.

    Raises ``LabError`` for a wrong emulator file, before anything boots.
    """
    try:
        if robot.emulator:
            build_robot(robot.emulator)
    except UserRobotError as error:
        raise LabError(f"robot {robot.name} has no emulator: {error}") from None


def cgroups(files: LabPaths) -> nspawn.Cgroups:
    """Returns the cgroups of the lab, as seen by this process."""
    own, mounts = Path("/proc/self/cgroup").read_text(), Path("/proc/self/mountinfo").read_text()
    return nspawn.cgroups(mounts, own, files.tag, delegated=False)


def require_cgroups(files: LabPaths) -> None:
    """Raises ``LabError`` if no cgroup tree is mounted."""
    if not cgroups(files).all:
        raise LabError("no cgroup tree is mounted on this machine", "mount -t cgroup2 none /sys/fs/cgroup")


def images_of(plan: LabPlan, progress: image.Progress) -> dict[str, Path]:
    """Returns the image for each ROS distribution, built where it is missing. Raises ``LabError``."""
    return {
        one: image.ensure(progress, distro=one, compilers=plan.compilers, engines=plan.engines)
        for one in plan.distros
    }


def load_or_create(files: LabPaths, plan: LabPlan) -> State:
    """Reads the state of the lab, or writes a new one.

    Raises ``LabError`` if the lab is up with another plan.
    """
    if files.state.exists():
        state = read_state(files)
        if state.plan != replace(plan, workspace=plan.workspace or state.plan.workspace):
            raise LabError(
                f"lab {plan.name} is up with other hosts, links or robots, or another workspace",
                "run `swarmctl lab down` first, or give this lab another name (--name)",
            )
        if gone := [one for one in state.images.values() if not one.is_dir()]:
            raise LabError(
                f"the image {gone[0]} of lab {plan.name} is gone", "run `swarmctl lab down`, then `up`"
            )
        return state
    state = State(plan, images_of(plan, lambda _: None))
    write_state(files, state)
    return state


def prepare_disks(files: LabPaths, state: State) -> int:
    """Creates missing keys and disks. Returns the number of new disks."""
    public = files.identity.with_suffix(".pub")
    if not public.exists():  # ssh-keygen writes it last
        files.identity.unlink(missing_ok=True)
        disks.generate_key(files.identity, f"swarmctl lab {files.name}")
    files.hosts.mkdir(exist_ok=True)
    authorized = public.read_text()
    stand_ins = state.stand_ins

    def prepare(host: LabHost) -> bool:
        plan = state.plan
        return disks.prepare(
            host,
            files.host(host.name),
            state.images[host.distro],
            authorized,
            workspace=plan.workspace,
            stand_ins=[one for one in stand_ins if one.host == host.name],
            distro=host.distro,
            aliases=plan.aliases,
            engines=plan.engines,
        )

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        fresh = sum(pool.map(prepare, state.plan.hosts))
    lines = (f"{host.name} {public_key(files, host.name)}\n" for host in state.plan.hosts)
    files.known_hosts.write_text("".join(lines))
    return fresh


def public_key(files: LabPaths, host: str) -> str:
    """Returns the type and the key of a host, without the comment."""
    return " ".join(files.host(host).host_key.read_text().split()[:2])


BOOT_TIMEOUT = 90.0  # s
PAUSE = 1.0  # s between two lines


def wait_for_hosts(files: LabPaths, plan: LabPlan, progress: Callable[[str], None], *, since: float) -> None:
    """Waits until the systemd and the sshd of every host run; ``progress`` gets at most one line a second.

    ``since`` is the start of the displayed time (``time.monotonic``). Raises ``LabError`` if a host fails.
    """
    waiting = {host.name: host for host in plan.hosts}
    cut_off = _cut_off(files)
    answered: list[str] = []
    noted = since
    while waiting:
        report = supervisor_client.running(files)["hosts"]
        for host in [host for name, host in waiting.items() if report[name]["state"] == "running"]:
            if host.name in cut_off:
                del waiting[host.name]
                progress(f"host {host.name}: running, but its network is cut")
            elif _answers_ssh(files, host):
                del waiting[host.name]
                answered.append(host.name)
        if answered and (not waiting or time.monotonic() - noted > PAUSE):
            listed = hostlist.written(host.name for host in plan.hosts if host.name in answered)
            progress(f"SSH answers on {listed}  {time.monotonic() - since:.1f} s")
            answered, noted = [], time.monotonic()
        for host in waiting.values():
            if not report[host.name]["wanted"]:
                output = last_lines(files.host(host.name).log)
                raise LabError(
                    f"host {host.name} did not start: exit status {report[host.name]['exit']}", *output
                )
        if waiting and time.monotonic() - since > BOOT_TIMEOUT:
            raise LabError(f"no SSH answer after {BOOT_TIMEOUT:.0f} s from: {', '.join(waiting)}")
        if waiting:
            time.sleep(0.05)


def _cut_off(files: LabPaths) -> set[str]:
    """Returns the hosts whose network of their address was disconnected by ``cut``."""
    plan = read_state(files).plan
    connected = network.link_states(plan, files)
    return {
        host.name
        for host in plan.hosts
        for interface in host.interfaces
        if ip_interface(interface.address).ip == ip_address(host.address)
        and not connected[host.name, interface.network]
    }


def _answers_ssh(files: LabPaths, host: LabHost) -> bool:
    def banner() -> bytes:
        with socket.create_connection((host.address, host.port), timeout=1.0) as connection:
            return connection.recv(4)

    try:
        return network.within(network.namespace_path(files), banner) == b"SSH-"
    except OSError:
        return False
