"""The public WireGuard keys of a swarm's hosts, as text. Two such texts are joined to one that has both.

A line has a host and a key in base64, and `retired` if no peer may use the key any more. A host has several
keys while it changes from one to the next. Keys are added and retired, and never come back: the order in
which texts are joined does not matter.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Iterable, Iterator

RETIRED = "retired"
LONGEST = 1 << 20  # bytes
_BASE64 = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/")
_LAST = frozenset("AEIMQUYcgkosw048")  # of 32 bytes, the last digit has 4 bits
_IN_NAMES = frozenset("abcdefghijklmnopqrstuvwxyz0123456789-")


class Keys:
    """The keys of each host, in the order of their lines: the ``live`` ones, and the ``retired`` ones.

    Hosts that have none but retired ones are ``expelled``.
    """

    def __init__(self, text: str = "") -> None:
        lines = [found for found in map(_parsed, text.splitlines()) if found]
        retired = {key for _, key, gone in lines if gone}
        self.live = _by_host((host, key) for host, key, _ in lines if key not in retired)
        self.retired = _by_host((host, key) for host, key, _ in lines if key in retired)
        self.expelled = frozenset(self.retired.keys() - self.live.keys())


def is_key(text: str) -> bool:
    """Returns True for 32 bytes in base64, as wg writes them. wg would print another text, into the log."""
    return len(text) == 44 and text[43] == "=" and text[42] in _LAST and _BASE64.issuperset(text[:42])


def line(host: str, key: str, *, retired: bool = False) -> str:
    """Returns a line of the text."""
    return f"{host} {key} {RETIRED}\n" if retired else f"{host} {key}\n"


def joined(text: str, other: str) -> str:
    """Returns ``text`` with the keys of ``other``. What else is in ``text`` stays."""
    lines = text.splitlines()
    places = {found[:2]: number for number, found in enumerate(map(_parsed, lines)) if found}
    for host, key, retired in filter(None, map(_parsed, other.splitlines())):
        place = places.setdefault((host, key), len(lines))
        if place == len(lines):
            lines.append(line(host, key, retired=retired)[:-1])
        elif retired:
            lines[place] = line(host, key, retired=True)[:-1]
    return "".join(f"{one}\n" for one in lines)


def renamed(text: str, host: str, new: str) -> str:
    """Returns ``text`` with ``new`` as the name of a host. What else is in ``text`` stays."""
    lines = text.splitlines(keepends=True)
    mine = [number for number, one in enumerate(lines) if (_parsed(one) or ("",))[0] == host]
    return "".join(one.replace(host, new, 1) if number in mine else one for number, one in enumerate(lines))


def lines_of(text: str, hosts: Iterable[str]) -> str:
    """Returns the live keys of ``hosts``, and all that are retired."""
    wanted, found = set(hosts), filter(None, map(_parsed, text.splitlines()))
    kept = [one for one in found if one[2] or one[0] in wanted]
    return "".join(line(host, key, retired=retired) for host, key, retired in kept)


def news(text: str, other: str) -> list[str]:
    """Returns the hosts of which ``joined`` adds or retires a key."""
    before, after = Keys(text), Keys(joined(text, other))
    hosts = {**after.live, **after.retired}
    return [
        host
        for host in hosts
        if before.live.get(host) != after.live.get(host)
        or before.retired.get(host) != after.retired.get(host)
    ]


def _parsed(text: str) -> tuple[str, str, bool] | None:
    words = text.split()
    if len(words) not in (2, 3) or words[2:] not in ([], [RETIRED]):
        return None
    host, key = words[:2]
    return (host, key, len(words) == 3) if is_key(key) and _IN_NAMES.issuperset(host) else None


def _by_host(pairs: Iterator[tuple[str, str]]) -> dict[str, tuple[str, ...]]:
    found: dict[str, dict[str, None]] = {}
    for host, key in pairs:
        found.setdefault(host, {})[key] = None
    return {host: tuple(own) for host, own in found.items()}
