"""What distinguishes one lab host's disk from the image: its name, its account, its keys. Files as values."""

from __future__ import annotations

import os
import secrets
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from swarmctl.lab.errors import LabError
from swarmctl.lab.places import HostHome
from swarmctl.lab.plan import LabHost, Workspace
from swarmctl.lab.processes import run

UID = 1000
GROUPS = ("sudo", "dialout")
ROOT = "root"
# systemd lays this over every unit whose name starts so (systemd.unit(5))
UNITS_OF_SWARMS = "etc/systemd/system/swarm-.service.d/workspace.conf"


@dataclass(frozen=True)
class Entry:
    """One file of a host that the image has otherwise or not at all."""

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
    """The account files of the image."""

    passwd: str
    group: str
    shadow: str

    @classmethod
    def of(cls, image: Path) -> Accounts:
        return cls(*((image / "etc" / name).read_text() for name in ("passwd", "group", "shadow")))


def entries(
    host: LabHost, accounts: Accounts, host_key: str, authorized: str, machine_id: str
) -> Iterator[Entry]:
    """The host's own files. ``host_key`` is its private SSH key, ``authorized`` the key that may log in."""
    yield Entry("etc/hostname", f"{host.name}\n")
    yield Entry("etc/hosts", f"127.0.0.1\tlocalhost\n127.0.1.1\t{host.name}\n::1\tlocalhost ip6-localhost\n")
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
    yield Entry(f"etc/sudoers.d/{host.user}", f"{host.user} ALL=(ALL:ALL) NOPASSWD: ALL\n", 0o440)
    yield Entry(f"home/{host.user}/.ssh/authorized_keys", authorized, 0o600, UID)


def _account(user: str, accounts: Accounts) -> Iterator[Entry]:
    if any(line.split(":")[0] == user for line in accounts.passwd.splitlines()):
        raise LabError(
            f"`{user}` is an account of the system itself", "give the host another `user` in the spec"
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
    """What lets a host find a workspace as if it were its own, and the swarm's hardened units see it."""
    if not any(f"{workspace.place}/".startswith(f"{folder}/") for folder in workspace.folders):
        yield Link(workspace.place.lstrip("/"), workspace.space)
    seen = " ".join(workspace.folders)
    yield Entry(UNITS_OF_SWARMS, f"[Service]\nProtectHome=tmpfs\nBindReadOnlyPaths={seen}\n")


def write(upper: Path, image: Path, files: Iterable[Entry | Link]) -> None:
    """Lay ``files`` over the image. A folder that the image has too keeps its mode and owner."""
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
    host: LabHost, place: HostHome, image: Path, authorized: str, workspace: Workspace | None = None
) -> bool:
    """Make the disk of a new host; whether there was none. A host's folder appears whole or not at all."""
    if place.directory.exists():
        return False
    fresh = HostHome(place.directory.with_name(f".{host.name}.new"))
    shutil.rmtree(fresh.directory, ignore_errors=True)
    for folder in (fresh.upper, fresh.work, fresh.root, fresh.pts):
        folder.mkdir(parents=True)
    shutil.copystat(image, fresh.upper)
    key = fresh.directory / "host_key"
    generate_key(key, host.name)
    own = entries(host, Accounts.of(image), key.read_text(), authorized, secrets.token_hex(16))
    write(fresh.upper, image, (*own, *(workspace_entries(workspace) if workspace else ())))
    key.unlink()
    fresh.directory.rename(place.directory)
    return True


def generate_key(path: Path, comment: str) -> None:
    """An Ed25519 key pair without a passphrase: ``path`` and ``path``.pub."""
    run(("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", comment, "-f", str(path)))
