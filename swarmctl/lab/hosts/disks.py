"""The disk of a lab host: the files that differ from the image (name, account, keys)."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.driver_stand_ins import StandIn
from swarmctl.lab.driver_stand_ins import files as stand_ins_files
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts.containers import packages_of
from swarmctl.lab.hosts.processes import run
from swarmctl.lab.lab_plan import LabHost, Workspace
from swarmctl.lab.paths import HostPaths

Aliases = Sequence[tuple[str, str]]  # names with their addresses

UID = 1000
GROUPS = ("sudo", "dialout")
ROOT = "root"
# a drop-in for every unit whose name starts with swarm- (systemd.unit(5))
SWARM_UNITS_DROP_IN = "etc/systemd/system/swarm-.service.d/workspace.conf"


@dataclass(frozen=True)
class Entry:
    """A file of a host that is not in the image or differs from it."""

    path: str
    content: str
    mode: int = 0o644
    owner: int = 0


@dataclass(frozen=True)
class Link:
    """A symbolic link on a host."""

    path: str
    target: str
    owner: int = 0


@dataclass(frozen=True)
class Accounts:
    """The contents of the image's account files."""

    passwd: str
    group: str
    shadow: str

    @classmethod
    def of(cls, image: Path) -> Accounts:
        """Returns the account files of an image. Raises ``OSError``."""
        return cls(*((image / "etc" / name).read_text() for name in ("passwd", "group", "shadow")))


def entries(
    host: LabHost,
    accounts: Accounts,
    host_key: str,
    authorized: str,
    machine_id: str,
    *,
    aliases: Aliases = (),
) -> Iterator[Entry]:
    """Yields the host's own files; ``host_key`` is its private SSH key, ``authorized`` the public key of
    swarmctl.
    """
    yield Entry("etc/hostname", f"{host.name}\n")
    known = "".join(f"{address}\t{name}\n" for name, address in aliases)
    local = f"127.0.0.1\tlocalhost\n127.0.1.1\t{host.name}\n::1\tlocalhost ip6-localhost\n"
    yield Entry("etc/hosts", local + known)
    yield Entry("etc/machine-id", f"{machine_id}\n", 0o444)
    yield Entry("etc/ssh/ssh_host_ed25519_key", host_key, 0o600)
    root_login = "prohibit-password" if host.user == ROOT else "no"
    yield Entry(
        "etc/ssh/sshd_config.d/lab.conf",
        f"Port {host.port}\nHostKey /etc/ssh/ssh_host_ed25519_key\nPermitRootLogin {root_login}\n"
        "PasswordAuthentication no\nUseDNS no\n",
    )
    if host.user == ROOT:
        yield Entry("root/.ssh/authorized_keys", authorized, 0o600)
        return
    yield from _account(host.user, accounts)
    # By number: an account in capitals is an alias to sudo, and a file with a dot in its name is ignored.
    yield Entry("etc/sudoers.d/account", f"#{UID} ALL=(ALL:ALL) NOPASSWD: ALL\n", 0o440)
    yield Entry(f"home/{host.user}/.ssh/authorized_keys", authorized, 0o600, UID)


def _account(user: str, accounts: Accounts) -> Iterator[Entry]:
    if any(line.split(":")[0] == user for line in accounts.passwd.splitlines()):
        raise LabError(
            f"`{user}` is a system account of Debian", "use another `user` for the host in the spec"
        )
    yield Entry("etc/passwd", f"{accounts.passwd}{user}:x:{UID}:{UID}:{user}:/home/{user}:/bin/bash\n")
    yield Entry("etc/shadow", f"{accounts.shadow}{user}:*:20000:0:99999:7:::\n", 0o640)
    joined = "".join(_with_member(line, user) for line in accounts.group.splitlines(keepends=True))
    yield Entry("etc/group", f"{joined}{user}:x:{UID}:\n")


def _with_member(line: str, user: str) -> str:
    name, password, gid, members = line.rstrip("\n").split(":")
    if name not in GROUPS:
        return line
    return f"{name}:{password}:{gid}:{','.join(filter(None, [members, user]))}\n"


def workspace_entries(workspace: Workspace) -> Iterator[Entry | Link]:
    """Yields what makes a workspace visible on a host, also to the hardened units of the swarm."""
    if not any(f"{workspace.place}/".startswith(f"{folder}/") for folder in workspace.folders):
        yield Link(workspace.place.lstrip("/"), workspace.space)
    bound = " ".join(workspace.folders)
    yield Entry(SWARM_UNITS_DROP_IN, f"[Service]\nProtectHome=tmpfs\nBindReadOnlyPaths={bound}\n")


def stand_in_entries(stand_ins: Iterable[StandIn], distro: str) -> Iterator[Entry]:
    """Yields the files of a host's stand-ins; ``distro``: of ROS."""
    for one in stand_ins_files(stand_ins, distro):
        yield Entry(one.path, one.content, 0o755 if one.executable else 0o644)


def write(upper: Path, image: Path, files: Iterable[Entry | Link]) -> None:
    """Writes ``files`` over the image. A folder that the image has too keeps its mode and owner."""
    for entry in files:
        path = upper / entry.path
        _folders(upper, image, path.parent.relative_to(upper), entry.owner)
        if isinstance(entry, Link):
            path.symlink_to(entry.target)
            continue
        path.write_text(entry.content)
        path.chmod(entry.mode)
        os.chown(path, entry.owner, entry.owner)


def _folders(upper: Path, image: Path, folder: Path, owner: int) -> None:
    for part in [*reversed(folder.parents), folder]:
        here, there = upper / part, image / part
        if here.is_dir():
            continue
        here.mkdir()
        if there.is_dir():
            shutil.copystat(there, here)
            os.chown(here, there.stat().st_uid, there.stat().st_gid)
        else:
            here.chmod(0o700 if here.name == ".ssh" else 0o755)
            os.chown(here, owner, owner)


def prepare(
    host: LabHost,
    files: HostPaths,
    image: Path,
    authorized: str,
    *,
    workspace: Workspace | None = None,
    stand_ins: Iterable[StandIn] = (),
    distro: str = "",
    aliases: Aliases = (),
    engines: Sequence[str] = (),
) -> bool:
    """Creates the disk of a host, atomically. Returns False if the host already has one.

    ``distro``: of ROS, for ``stand_ins``; ``engines``: of its containers, such as podman.
    """
    if files.directory.exists():
        return False
    fresh = HostPaths(files.directory.with_name(f".{host.name}.new"))
    shutil.rmtree(fresh.directory, ignore_errors=True)
    for folder in (
        *(fresh.upper, fresh.work, fresh.root, fresh.pts),
        *((fresh.containers,) if packages_of(engines) else ()),
    ):
        folder.mkdir(parents=True)
    shutil.copystat(image, fresh.upper)
    key = fresh.directory / "host_key"
    generate_key(key, host.name)
    own = entries(
        host, Accounts.of(image), key.read_text(), authorized, secrets.token_hex(16), aliases=aliases
    )
    built = workspace_entries(workspace) if workspace else ()
    write(fresh.upper, image, (*own, *built, *stand_in_entries(stand_ins, distro)))
    key.unlink()
    fresh.directory.rename(files.directory)
    return True


def generate_key(path: Path, comment: str) -> None:
    """Creates an Ed25519 key pair without a passphrase: ``path`` and ``path``.pub."""
    run(("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", comment, "-f", str(path)))
