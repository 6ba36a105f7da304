"""How one lab host is started: overlay and terminals mounted, systemd-nspawn in a cgroup of its own."""

from __future__ import annotations

import errno
import re
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.places import HostHome
from swarmctl.lab.plan import LabHost, Workspace

PTS_INSIDE = "/run/lab-pts"  # where a host sees the terminals that its robots hang on
DIALOUT = 20  # gid of group dialout, fixed in Debian
REBOOT = 133  # with which systemd-nspawn ends when its host asked for a reboot

_JOIN = 'echo $$ > "$0/cgroup.procs" && exec "$@"'


@dataclass(frozen=True)
class Cgroups:
    """Where in the cgroup trees a lab lives: the unified one and, on hybrid machines, systemd's named one.

    Hosts that shared one would take each other's services for their own: they have the same paths inside.
    """

    unified: Path | None
    named: Path | None

    @property
    def all(self) -> tuple[Path, ...]:
        return tuple(tree for tree in (self.unified, self.named) if tree is not None)


def cgroups(mountinfo: str, own: str, tag: str, *, delegated: bool) -> Cgroups:
    """The lab's cgroups, from /proc/self/mountinfo and /proc/self/cgroup.

    Where systemd runs the machine it has ``delegated`` our own cgroup to us; elsewhere the top is free.
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


def mount_argvs(image: Path, place: HostHome) -> tuple[tuple[str, ...], ...]:
    """A disk over the image that keeps what is written, and terminals that only this host and the lab see."""
    layers = f"lowerdir={image},upperdir={place.upper},workdir={place.work}"
    terminals = f"newinstance,ptmxmode=0666,mode=0660,gid={DIALOUT}"
    return (
        ("mount", "-t", "overlay", "overlay", "-o", layers, str(place.root)),
        ("mount", "-t", "devpts", "devpts", "-o", terminals, str(place.pts)),
    )


def nspawn_argv(
    host: LabHost, place: HostHome, namespace: Path, workspace: Workspace | None = None
) -> tuple[str, ...]:
    """Boot systemd in ``place``, with the network of ``namespace``."""
    return (
        *("systemd-nspawn", "--quiet", "--register=no", "--keep-unit", "--boot", "--notify-ready=yes"),
        *("--directory", str(place.root), "--machine", host.name, f"--hostname={host.name}"),
        *("--capability=CAP_NET_ADMIN", f"--network-namespace-path={namespace}"),
        *("--console=passive", "--resolv-conf=off", "--timezone=off", "--link-journal=no"),
        f"--bind={place.pts}:{PTS_INSIDE}",
        *(f"--bind-ro={folder}" for folder in (workspace.folders if workspace else ())),
    )


def joining(argv: Sequence[str], folders: Sequence[Path]) -> tuple[str, ...]:
    """``argv``, started inside the cgroups ``folders``."""
    joined = tuple(argv)
    for folder in folders:
        joined = ("sh", "-c", _JOIN, str(folder), *joined)
    return joined


def nspawn_environment(groups: Cgroups) -> dict[str, str]:
    """Hosts get the unified tree wherever there is one: two hybrid systemds would get in each other's way."""
    return {"SYSTEMD_NSPAWN_UNIFIED_HIERARCHY": "1"} if groups.unified else {}


def drop_cgroup(folder: Path, patience: float = 10.0) -> None:
    """Remove a cgroup and what is below it, once the last of the processes killed in it are gone."""
    if not folder.is_dir():
        return
    for below in folder.iterdir():
        if below.is_dir():
            drop_cgroup(below, patience)
    deadline = time.monotonic() + patience
    while True:
        try:
            folder.rmdir()
            return
        except OSError as error:
            if error.errno != errno.EBUSY or time.monotonic() > deadline:
                raise
        time.sleep(0.01)
