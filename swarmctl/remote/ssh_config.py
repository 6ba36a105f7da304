"""HostName, User, Port, IdentityFile and the proxy of a host from ``~/.ssh/config``. Runs no command of it.

A block applies when its patterns match the host's name in the spec or its address. User, port and jump host
of the spec win over the file, as options on the command line of ``ssh`` do. paramiko.SSHConfig does not fit:
no Include, it runs ``Match exec``, applies blocks with criteria it does not support, and waits for DNS.
"""

from __future__ import annotations

import glob
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from swarmctl.remote.known_hosts import KnownHosts
from swarmctl.remote.openssh_files import OpenSshFileError, matches, read_text
from swarmctl.remote.transport import Target

_MAX_JUMPS = 8
_MAX_INCLUDES = 16  # in one another, as in OpenSSH
_SINGLE = ("hostname", "user", "port", "identityfile")  # options of one argument
# How to log in, in ways that only the program ssh knows; with the values that say nothing.
_SSH_ONLY = {
    "CertificateFile": ("none",),
    "PKCS11Provider": ("none",),
    "SecurityKeyProvider": ("none", "internal"),
    "IdentityAgent": ("none", "ssh_auth_sock"),
    "GSSAPIAuthentication": ("no",),
}
_READ = ("host", "match", "include", "proxyjump", *_SINGLE, *map(str.lower, _SSH_ONLY))

Options = dict[str, list[str]]  # values by lower-case option, in the order in which they apply


@dataclass(frozen=True)
class Login:
    """What the spec declares about reaching a host; None where ``~/.ssh/config`` decides.

    ``default_user`` applies where neither names an account; without it, the local account does.
    """

    host: str
    address: str
    user: str | None = None
    port: int | None = None
    via: Login | None = None
    default_user: str | None = None


class SshConfig:
    """A configuration file and its includes, each read once. ``warnings`` lists what is ignored."""

    def __init__(self, path: Path) -> None:
        """``path`` need not exist: ssh works without a configuration, too."""
        self._path = path
        self._files: dict[Path, list[tuple[str, list[str]]]] = {}
        self.warnings: dict[str, None] = {}

    def options(self, names: Sequence[str]) -> Options:
        """Returns the options that apply to a host with these names. Raises ``OpenSshFileError``."""
        found: Options = {}
        for option, words in self._walk(self._path, names) if self._path.exists() else ():
            found.setdefault(option, []).append(words[0] if option in _SINGLE else " ".join(words))
        return found

    def _walk(self, path: Path, names: Sequence[str], depth: int = 0) -> Iterator[tuple[str, list[str]]]:
        """The lines of a file that apply. An included file is read only where its Include applies."""
        if depth > _MAX_INCLUDES:
            raise OpenSshFileError(
                f"{path}: more than {_MAX_INCLUDES} nested Includes; does it include itself?"
            )
        applies = True
        for option, words in self._read(path):
            if option == "host":
                applies = matches(words, names)
            elif applies and option == "include":
                for pattern in words:
                    place = self._path.parent / Path(pattern).expanduser()
                    for found in sorted(glob.glob(str(place))):  # noqa: PTH207  here `**` is not recursive
                        yield from self._walk(Path(found), names, depth + 1)
            elif applies:
                yield option, words

    def _read(self, path: Path) -> list[tuple[str, list[str]]]:
        if path not in self._files:
            lines = enumerate(read_text(path).splitlines(), 1)
            self._files[path] = [line for at, text in lines if (line := self._line(text, f"{path}:{at}"))]
        return self._files[path]

    def _line(self, text: str, place: str) -> tuple[str, list[str]] | None:
        """Option and arguments; ``Port 22``, ``Port=22``, ``Port = 22`` are the same. Match becomes Host."""
        text = text.strip()
        end = next((at for at, char in enumerate(text) if char.isspace() or char == "="), len(text))
        option, value = text[:end].lower(), text[end:].lstrip().removeprefix("=")
        if option == "proxycommand":  # shell syntax of its own
            return option, [value.strip()]
        if option not in _READ:
            return None
        try:
            words = shlex.split(value)
        except ValueError:
            raise OpenSshFileError(f"{place}: a quotation mark is missing") from None
        if not any(words):
            raise OpenSshFileError(f"{place}: {text} has no value")
        if option == "port" and not (words[0].isdecimal() and 0 < int(words[0]) < 1 << 16):
            raise OpenSshFileError(f"{place}: Port {words[0]} is not a number from 1 to 65535")
        return ("host", self._match_line(words, place)) if option == "match" else (option, words)

    def _match_line(self, words: list[str], place: str) -> list[str]:
        """The host patterns of a Match line; none, with a warning, for criteria that are not supported."""
        match [word.lower() for word in words[:1]], words[1:]:
            case (["all"], []):
                return ["*"]
            case (["originalhost"], [patterns]):
                return patterns.split(",")
        self.warnings[
            f"{place}: `Match {' '.join(words)}` is ignored; only `all` and `originalhost` are supported"
        ] = None
        return []


@dataclass(frozen=True)
class Resolver:
    """Puts the spec, ``~/.ssh/config`` and the pinned keys together, for hosts and for their jump hosts."""

    config: SshConfig
    known: KnownHosts
    local_user: str
    home: Path

    def target(self, login: Login, depth: int = 0, before: Target | None = None) -> Target:
        """Returns how to reach a host; ``before`` is the hop before it in ProxyJump.

        Raises ``OpenSshFileError``.
        """
        options = self.config.options((login.host, login.address))
        address = options.get("hostname", [login.address])[0].replace("%h", login.address)
        user = login.user or options.get("user", [login.default_user or self.local_user])[0]
        port = login.port or int(options.get("port", ["22"])[0])
        jump = before or self._jump(login, _proxy(options, "proxyjump"), depth)
        return Target(
            host=login.host,
            address=address,
            user=user,
            port=port,
            keys=self.known.keys(login.host, address, port),
            revoked=self.known.revoked(login.host, address, port),
            identities=self._identities(options.get("identityfile", []), login.host, address, user),
            jump=jump,
            proxy_command="" if jump else _proxy(options, "proxycommand"),
            ssh_only=tuple(
                name
                for name, nothing in _SSH_ONLY.items()
                if any(value.lower() not in nothing for value in options.get(name.lower(), ()))
            ),
        )

    def _identities(self, texts: Sequence[str], host: str, address: str, user: str) -> tuple[Path, ...]:
        tokens = {"%d": str(self.home), "%h": address, "%n": host, "%r": user, "%u": self.local_user}
        texts = [text for text in texts if text.lower() != "none"]
        for token, value in tokens.items():
            texts = [text.replace(token, value) for text in texts]
        return tuple(self.home / text[2:] if text.startswith("~/") else Path(text) for text in texts)

    def _jump(self, login: Login, jumps: str, depth: int) -> Target | None:
        if login.via is None and not jumps:
            return None
        if depth >= _MAX_JUMPS:
            self._warn(f"{login.host}: its jump hosts form a circle; the last one is ignored")
            return None
        if login.via is not None:
            return self.target(login.via, depth + 1)
        hop = None
        for text in jumps.split(","):
            hop = self.target(_hop(text.strip()), depth + 1, hop)
        return hop

    def _warn(self, text: str) -> None:
        self.config.warnings[text] = None


def _proxy(options: Options, wanted: str) -> str:
    """The value of this kind of proxy; empty if it is none, or if the other kind counts.

    The first kind counts, and `ProxyJump none` leaves the choice to ProxyCommand.
    """
    jump = options.get("proxyjump", ["none"])[0]
    kinds = [name for name in options if name == "proxycommand" or (name == "proxyjump" and not _none(jump))]
    value = options[wanted][0] if kinds[:1] == [wanted] else "none"
    return "" if _none(value) else value


def _none(value: str) -> bool:
    return value.lower() == "none"


def _hop(text: str) -> Login:
    """``[user@]host[:port]`` or ``ssh://[user@]host[:port]``; IPv6 addresses in brackets."""
    user, _, place = text.removeprefix("ssh://").rpartition("@")
    if place.startswith("["):
        host, _, port = place[1:].partition("]")
        port = port.removeprefix(":")
    else:
        host, _, port = place.partition(":")
    return Login(host, host, user or None, int(port) if port.isdecimal() else None)
