"""What ``~/.ssh/config`` says of a host: HostName, User, Port, IdentityFile, ProxyJump. Runs no command.

A block counts for a host when its patterns match the host's name in the spec or its address. What the spec
says about user and port goes before the file, as the command line of ``ssh`` does.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

from swarmctl.remote.transport import Target

_DEEPEST = 8  # includes in includes, jumps behind jumps
_READ = ("hostname", "user", "port", "identityfile", "proxyjump", "proxycommand")

Patterns = tuple[str, ...]
Reader = Callable[[str], Iterable[tuple[str, str]]]  # an Include's pattern to (file name, text) pairs


@dataclass(frozen=True)
class Rule:
    """One option, and the Host lines that must all match for it to count."""

    conditions: tuple[Patterns, ...]
    option: str
    value: str

    def counts_for(self, names: Iterable[str]) -> bool:
        return all(_match(patterns, names) for patterns in self.conditions)


@dataclass(frozen=True)
class SshConfig:
    """A read file. ``warnings`` name what was passed over."""

    rules: tuple[Rule, ...] = ()
    warnings: tuple[str, ...] = ()

    def values(self, option: str, names: Iterable[str]) -> list[str]:
        return [rule.value for rule in self.rules if rule.option == option and rule.counts_for(names)]


@dataclass(frozen=True)
class Login:
    """What the spec says about reaching a host; None where it leaves the choice to ``~/.ssh/config``."""

    host: str
    address: str
    user: str | None = None
    port: int | None = None
    via: Login | None = None


@dataclass(frozen=True)
class Resolved:
    """A target, and what of the file was passed over on the way to it."""

    target: Target
    warnings: tuple[str, ...] = ()


def load(path: Path) -> SshConfig:
    """Read a file and those it includes; an absent one says nothing."""

    def read(pattern: str) -> Iterator[tuple[str, str]]:
        place = Path(pattern).expanduser()
        base = path.parent
        absolute = place if place.is_absolute() else base / place
        for found in sorted(Path(absolute.anchor).glob(str(absolute.relative_to(absolute.anchor)))):
            if found.is_file():
                yield str(found), found.read_text(encoding="utf-8", errors="replace")

    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except FileNotFoundError:
        return SshConfig()
    except OSError as error:
        return SshConfig(warnings=(f"{path}: cannot be read: {error.strerror}",))
    return parse(text, str(path), read)


def parse(text: str, name: str = "config", read: Reader = lambda _: ()) -> SshConfig:
    """Read the text of a file. ``read`` brings what an Include names."""
    parser = _Parser(read)
    parser.take(text, name, ())
    return SshConfig(tuple(parser.rules), tuple(parser.warnings))


class _Parser:
    def __init__(self, read: Reader) -> None:
        self._read = read
        self.rules: list[Rule] = []
        self.warnings: list[str] = []

    def take(self, text: str, name: str, outer: tuple[Patterns, ...], depth: int = 0) -> None:
        """Read one file, which counts only where ``outer`` matches."""
        conditions = outer
        for number, line in enumerate(text.splitlines(), 1):
            place = f"{name}:{number}"
            try:
                option, words = _words(line)
            except ValueError:
                self.warnings.append(f"{place}: a quotation mark is missing; the line is passed over")
                continue
            if option == "host":
                conditions = (*outer, tuple(words))
            elif option == "match":
                conditions = (*outer, self._match_line(words, place))
            elif option == "include" and depth < _DEEPEST:
                for pattern in words:
                    for inner, content in self._read(pattern):
                        self.take(content, inner, conditions, depth + 1)
            elif option in _READ and words:
                self.rules.append(Rule(conditions, option, " ".join(words)))

    def _match_line(self, words: list[str], place: str) -> Patterns:
        match [word.lower() for word in words[:1]], words[1:]:
            case (["all"], []):
                return ("*",)
            case (["originalhost"], [patterns]):
                return tuple(patterns.split(","))
        self.warnings.append(
            f"{place}: `Match {' '.join(words)}` is passed over; only `all` and `originalhost` are known"
        )
        return ()


def _words(line: str) -> tuple[str, list[str]]:
    """The option in lower case, and its arguments: ``Port 22``, ``Port=22``, ``Port = 22`` are the same."""
    stripped = line.strip()
    if not stripped or stripped.startswith("#"):
        return "", []
    end = next((at for at, char in enumerate(stripped) if char.isspace() or char == "="), len(stripped))
    return stripped[:end].lower(), shlex.split(stripped[end:].lstrip().removeprefix("="))


def _match(patterns: Patterns, names: Iterable[str]) -> bool:
    """OpenSSH's rule: one pattern matches, and none that begins with ``!`` does. Brackets mean themselves."""
    found = False
    for pattern in patterns:
        plain = pattern.removeprefix("!").replace("[", "[[]")
        if any(fnmatchcase(name, plain) for name in names):
            if pattern.startswith("!"):
                return False
            found = True
    return found


def resolve(
    config: SshConfig, login: Login, keys: Mapping[str, tuple[str, ...]], *, local_user: str, home: Path
) -> Resolved:
    """The way to a host. ``keys`` are the pinned keys by host name, those of jump hosts included."""
    warnings: list[str] = []
    target = _Resolver(config, keys, local_user, home, warnings).target(login)
    return Resolved(target, tuple(dict.fromkeys(warnings)))


@dataclass(frozen=True)
class _Resolver:
    config: SshConfig
    keys: Mapping[str, tuple[str, ...]]
    local_user: str
    home: Path
    warnings: list[str]

    def target(self, login: Login, depth: int = 0, before: Target | None = None) -> Target:
        """``before`` is a hop that ProxyJump puts in front of this one."""
        names = (login.host, login.address)
        address = self._first("hostname", names, login.address).replace("%h", login.address)
        user = login.user or self._first("user", names, self.local_user)
        if self.config.values("proxycommand", names):
            self.warnings.append(f"{login.host}: ProxyCommand in ~/.ssh/config is passed over; use ProxyJump")
        return Target(
            host=login.host,
            address=address,
            user=user,
            port=login.port or self._port(names),
            keys=self.keys.get(login.host, ()),
            identities=self._identities(names, address, user),
            jump=before or self._jump(login, names, depth),
        )

    def _first(self, option: str, names: tuple[str, ...], default: str) -> str:
        return next(iter(self.config.values(option, names)), default)

    def _port(self, names: tuple[str, ...]) -> int:
        text = self._first("port", names, "22")
        if text.isdecimal() and 0 < int(text) < 1 << 16:
            return int(text)
        self.warnings.append(f"{names[0]}: Port {text} in ~/.ssh/config is no port; 22 is used")
        return 22

    def _identities(self, names: tuple[str, ...], address: str, user: str) -> tuple[Path, ...]:
        tokens = {"%d": str(self.home), "%h": address, "%n": names[0], "%r": user, "%u": self.local_user}
        texts = [text for text in self.config.values("identityfile", names) if text.lower() != "none"]
        for token, value in tokens.items():
            texts = [text.replace(token, value) for text in texts]
        return tuple(self.home / text[2:] if text.startswith("~/") else Path(text) for text in texts)

    def _jump(self, login: Login, names: tuple[str, ...], depth: int) -> Target | None:
        jumps = self._first("proxyjump", names, "none")
        if login.via is None and jumps.lower() == "none":
            return None
        if depth >= _DEEPEST:
            self.warnings.append(f"{login.host}: its jump hosts lead in a circle; the last is passed over")
            return None
        if login.via is not None:
            return self.target(login.via, depth + 1)
        hop = None
        for text in jumps.split(","):
            hop = self.target(_hop(text.strip()), depth + 1, hop)
        return hop


def _hop(text: str) -> Login:
    """``[user@]host[:port]`` or ``ssh://[user@]host[:port]``; IPv6 addresses in brackets."""
    user, _, place = text.removeprefix("ssh://").rpartition("@")
    if place.startswith("["):
        host, _, port = place[1:].partition("]")
        port = port.removeprefix(":")
    else:
        host, _, port = place.partition(":")
    return Login(host, host, user or None, int(port) if port.isdecimal() else None)
