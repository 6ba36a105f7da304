"""The configuration with which the program ``ssh`` logs in to one host. Pure: text from values.

Of several values of an option ``ssh`` takes the first, so what swarmctl promises stands first, and the
user's own files follow: they decide about keys, certificates, tokens, algorithms and the like.
"""

from __future__ import annotations

import glob
import re
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote.transport import HostError, Kind, Target

# What reaches a shell by %h, %r or %n in a ProxyCommand. OpenSSH checks it since version 9.6 only.
_PLAIN = re.compile(r"[\w.:%@+-]+", re.ASCII)
_SYSTEM = Path("/etc/ssh/ssh_config")

# Host keys are those beside the spec, and nothing else vouches for a host.
_HOST_KEYS = {
    "StrictHostKeyChecking": "yes",
    "GlobalKnownHostsFile": "none",
    "UpdateHostKeys": "no",
    "CheckHostIP": "no",
    "VerifyHostKeyDNS": "no",
    "NoHostAuthenticationForLocalhost": "no",
    "GSSAPIKeyExchange": "no",
    "HashKnownHosts": "no",
    "CanonicalizeHostname": "no",
}
_ALWAYS = {
    **_HOST_KEYS,
    # No password is sent, and no program of ssh's own asks for one on the terminal.
    "BatchMode": "yes",
    "PasswordAuthentication": "no",
    "KbdInteractiveAuthentication": "no",
    "HostbasedAuthentication": "no",
    "EnableSSHKeysign": "no",
    # The host gets nothing that is the operator's, and a session runs what swarmctl sends alone.
    "GSSAPIDelegateCredentials": "no",
    "ForwardAgent": "no",
    "ForwardX11": "no",
    "ClearAllForwardings": "yes",
    "Tunnel": "no",
    "AddKeysToAgent": "no",
    "PermitLocalCommand": "no",
    "RemoteCommand": "none",
    "RequestTTY": "no",
    "ForkAfterAuthentication": "no",
    "StdinNull": "yes",
    "EscapeChar": "none",
    # The connection is swarmctl's own; its sessions share it.
    "ControlMaster": "yes",
    "ControlPersist": "no",
    "ConnectionAttempts": "1",
    "TCPKeepAlive": "yes",
    "LogLevel": "DEBUG1",
    "SyslogFacility": "USER",
    "VisualHostKey": "no",
}


@dataclass(frozen=True)
class Files:
    """The files of one login, in a folder of its own."""

    folder: Path

    @property
    def configuration(self) -> Path:
        """What ``ssh -F`` gets."""
        return self.folder / "config"

    @property
    def known_hosts(self) -> Path:
        """The pinned keys of this host."""
        return self.folder / "known_hosts"

    @property
    def control(self) -> Path:
        """The socket of the connection, for its sessions."""
        return self.folder / "ctl"

    @property
    def log(self) -> Path:
        """The pipe to which ``ssh`` writes what it does."""
        return self.folder / "log"

    @property
    def shown(self) -> Path:
        """The host keys that a scan has seen."""
        return self.folder / "shown"

    def shown_key(self) -> str:
        """The host key that a scan has seen; empty if it has seen none."""
        lines = self.shown.read_text().splitlines() if self.shown.exists() else []
        keys = [line.split() for line in lines if not line.startswith("ORDER ")]
        return " ".join(keys[-1][1:]) if keys else ""


def configuration(
    target: Target,
    files: Files,
    *,
    home: Path,
    identities: Sequence[Path],
    use_agent: bool,
    way: str,
    connect: float,
    acknowledgement: float,
    scan: bool,
) -> str:
    """The text of the configuration. ``way``: the command that leads to the host; empty: a TCP connection.

    ``home``: the folder ``.ssh``. ``scan``: no login, and the key that the host shows goes to
    ``files.shown``. Times are in s. Raises ``HostError`` for names that no host has.
    """
    _need_plain(target)
    own: dict[str, str] = {
        "HostName": target.address.replace("%", "%%"),
        "User": target.user,
        "Port": str(target.port),
        "HostKeyAlias": target.host.lower(),
        "UserKnownHostsFile": _path(files.known_hosts),
        "ControlPath": _path(files.control),
        "ConnectTimeout": str(max(1, round(connect))),
        "ServerAliveInterval": str(max(1, round(acknowledgement / 3))),
        "ServerAliveCountMax": "3",
        "KnownHostsCommand": _note_key(files) if scan else "none",
        "PubkeyAuthentication": "no" if scan else "yes",
        **({"GSSAPIAuthentication": "no"} if scan else {}),
        **({} if use_agent else {"IdentityAgent": "none"}),
        "ProxyCommand": way or "none",  # `ProxyJump none` would leave it to the user's files
        **_ALWAYS,
    }
    keys = [f"IdentityFile {_path(path)}" for path in identities] or ["IdentityFile none"]
    return "\n".join(
        [
            "IgnoreUnknown *",  # an older or newer ssh, another build of it; what it lacks it cannot do
            "Host *",
            *_lines(own),
            *keys,
            # What follows is read once more with the address in place of the name: blocks for either apply.
            "Match final all",
            "Match all",
            *(f"Include {_path(Path(glob.escape(str(path))))}" for path in (home / "config", _SYSTEM)),
            "",
        ]
    )


def known_hosts(target: Target) -> str:
    """The text of the file with the pinned keys of one host."""
    name = target.host.lower()
    revoked = (f"@revoked {name} {key}\n" for key in target.revoked)
    return "".join([*(f"{name} {key}\n" for key in target.keys), *revoked])


def interactive(
    target: Target,
    pinned: Path,
    alias: Callable[[Target], str],
    command: str = "",
    *,
    terminal: bool = False,
    connect: float,
    acknowledgement: float,
) -> tuple[str, ...]:
    """The command line of ``ssh`` for a person: a shell on the host, or ``command`` there.

    The user's files decide what is neither the way to the host nor its key. ``pinned`` is the file with the
    keys, in which a host is called ``alias``. Times are in s. Raises ``HostError`` for names that no host
    has.
    """
    _need_plain(target)
    own = {
        "HostName": target.address.replace("%", "%%"),
        "User": target.user,
        "Port": str(target.port),
        "HostKeyAlias": alias(target),
        "UserKnownHostsFile": _path(pinned),
        "KnownHostsCommand": "none",
        "ControlPath": "none",  # a connection of the user's may have been opened with other keys
        "ConnectTimeout": str(max(1, round(connect))),
        "ServerAliveInterval": str(max(1, round(acknowledgement / 3))),
        "ServerAliveCountMax": "3",
        "ProxyCommand": target.proxy_command or "none",
        **_HOST_KEYS,
    }
    if target.jump is not None:
        hop = interactive(target.jump, pinned, alias, connect=connect, acknowledgement=acknowledgement)
        way = [*hop[:-2], "-W", f"[{target.address}]:{target.port}", *hop[-2:]]
        own["ProxyCommand"] = shlex.join(way).replace("%", "%%")
    lines = [*own.items(), *(("IdentityFile", _path(path.expanduser())) for path in target.identities)]
    words = [word for name, value in lines for word in ("-o", f"{name}={value}")]
    return ("ssh", *words, *(["-t"] if terminal else []), "--", target.host, *([command] if command else []))


def _need_plain(target: Target) -> None:
    for text in (target.host, target.address, target.user):
        if not _PLAIN.fullmatch(text) or text.startswith("-"):
            raise HostError(Kind.UNREACHABLE, f"{target.host}: ssh cannot be given the name {text!r}")


def through(hop: Target, files: Files, program: str) -> str:
    """The command that leads from the connection to a jump host to the host behind it."""
    control = str(files.control).replace("%", "%%")
    return f"{program} -F none -S {control} -o ControlMaster=no -W [%h]:%p {hop.host}"


def _lines(options: Mapping[str, str]) -> list[str]:
    return [f"{name} {value}" for name, value in options.items()]


def _path(path: Path) -> str:
    escaped = str(path).replace("%", "%%").replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


def _note_key(files: Files) -> str:
    """A command that appends the shown key to a file, and vouches for none.

    ``ssh`` runs it also before it has a key, with ``ORDER``.
    """
    return f"/bin/sh -c \"printf '%%s\\\\n' '%I %t %K' >>'{files.shown}'\""
