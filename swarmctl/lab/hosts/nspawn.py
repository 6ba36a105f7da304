"""The commands that start a lab host: mounts, and systemd-nspawn in a cgroup of its own."""

from __future__ import annotations

import errno
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.hosts import containers
from swarmctl.lab.lab_plan import LabHost, Workspace
from swarmctl.lab.paths import HostPaths

PTS_INSIDE = "/run/lab-pts"  # the terminals of its robots, inside a host
DIALOUT = 20  # gid of group dialout, fixed in Debian
REBOOT = 133  # the exit status of systemd-nspawn for a reboot

_JOIN = 'echo $$ > "$0/cgroup.procs" && exec "$@"'


@dataclass(frozen=True)
class Cgroups:
    """The cgroups of a lab: in the unified tree and, on hybrid machines, in systemd's named one.

    Each host has its own below them: unit paths inside the hosts are the same and would collide.
    """

    unified: Path | None
    named: Path | None

    @property
    def all(self) -> tuple[Path, ...]:
        """The cgroup trees that exist."""
        return tuple(tree for tree in (self.unified, self.named) if tree is not None)


def cgroups(mountinfo: str, own: str, tag: str, *, delegated: bool) -> Cgroups:
    """Returns the lab's cgroups, from the texts of /proc/self/mountinfo and /proc/self/cgroup.

    ``delegated``: systemd runs the machine and has delegated our own cgroup; else they are below the root.
    """
    mounts: dict[str, Path] = {}
    for line in mountinfo.splitlines():
        before, _, after = line.partition(" - ")
        kind, _, options = after.split(" ", 2)
        if kind == "cgroup2":
            mounts.setdefault("", Path(before.split()[4]))
        elif kind == "cgroup" and "name=systemd" in options.split(","):
            mounts.setdefault("name=systemd", Path(before.split()[4]))
    found: dict[str, Path] = {}
    for controllers, path in re.findall(r"^\d+:([^:]*):(.*)$", own, re.MULTILINE):
        if controllers in mounts:
            start = mounts[controllers] / path.lstrip("/") if delegated else mounts[controllers]
            found[controllers] = start / tag
    return Cgroups(found.get(""), found.get("name=systemd"))


def mount_argvs(image: Path, files: HostPaths) -> tuple[tuple[str, ...], ...]:
    """Returns the mount commands of a writable overlay over the image, and of a private devpts."""
    layers = f"lowerdir={image},upperdir={files.upper},workdir={files.work}"
    terminals = f"newinstance,ptmxmode=0666,mode=0660,gid={DIALOUT}"
    return (
        ("mount", "-t", "overlay", "overlay", "-o", layers, str(files.root)),
        ("mount", "-t", "devpts", "devpts", "-o", terminals, str(files.pts)),
    )


def nspawn_argv(
    host: LabHost,
    files: HostPaths,
    namespace: Path,
    workspace: Workspace | None = None,
    engines: Sequence[str] = (),
) -> tuple[str, ...]:
    """Returns the command that boots systemd in ``files``, with the network of ``namespace``.

    ``engines``: of its containers, such as podman.
    """
    return (
        *("systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", "--notify-ready=yes"),
        *("--directory", str(files.root), "--machine", host.name, f"--hostname={host.name}"),
        *("--capability=CAP_NET_ADMIN", f"--network-namespace-path={namespace}"),
        "--system-call-filter=bpf",  # by it systemd denies a unit addresses and devices
        *("--console=passive", "--resolv-conf=off", "--timezone=off", "--link-journal=no"),
        f"--bind={files.pts}:{PTS_INSIDE}",
        *(f"--bind-ro={folder}" for folder in (workspace.folders if workspace else ())),
        *containers.nspawn_options(files, engines),
    )


def in_cgroups(argv: Sequence[str], folders: Sequence[Path]) -> tuple[str, ...]:
    """Returns a command that runs ``argv`` inside the cgroups ``folders``."""
    joined = tuple(argv)
    for folder in folders:
        joined = ("sh", "-c", _JOIN, str(folder), *joined)
    return joined


def nspawn_environment(groups: Cgroups) -> dict[str, str]:
    """Returns variables that select the unified tree, if there is one: hybrid hosts on a hybrid machine
    collide.
    """
    return {"SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"} if groups.unified else {}


def remove_cgroup(folder: Path, timeout: float = 10.0) -> None:
    """Removes a cgroup and those below it; waits up to ``timeout`` s until its killed processes are gone."""
    if not folder.is_dir():
        return
    for below in folder.iterdir():
        if below.is_dir():
            remove_cgroup(below, timeout)
    deadline = time.monotonic() + timeout
    while True:
        try:
            folder.rmdir()
            return
        except OSError as error:
            if error.errno != errno.EBUSY or time.monotonic() > deadline:
                raise
        time.sleep(0.01)
