"""Did you mean: the nearest of a closed set of words."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from functools import lru_cache

_NEAR = 0.6
_MANY = 500

# What people write first, where the spec uses another word.
_OTHER_WORDS = {
    "hostname": "address",
    "ip": "address",
    "username": "user",
    "login": "user",
    "robot": "robots",
    "host": "hosts",
    "link": "links",
    "program": "programs",
    "master": "hub",
    "roscore": "hub",
    "central": "hub",
    "baudrate": "baud",
    "port": "device",
    "tty": "device",
    "parameters": "settings",
    "params": "settings",
    "model": "type",
    "serial": "usb",
    "vid": "vendor",
    "pid": "product",
    "bdaddr": "mac",
    "wifi": "wlan",
    "wireless": "wlan",
    "lan": "ethernet",
    "wired": "ethernet",
    "uart": "serial",
    "rfcomm": "bluetooth",
    "bt": "bluetooth",
}


@lru_cache(maxsize=4096)  # one wrong name may stand in ten thousand places
def nearest(word: str, known: tuple[str, ...]) -> str | None:
    """The one of ``known`` that was most likely meant, or none. Large sets are narrowed by first letter."""
    words = known
    if _OTHER_WORDS.get(word) in words:
        return _OTHER_WORDS[word]
    if len(words) > _MANY:
        words = tuple(one for one in words if one[:1] == word[:1] and abs(len(one) - len(word)) <= 2)
    found = difflib.get_close_matches(word, words, n=1, cutoff=_NEAR)
    return found[0] if found else None


def did_you_mean(word: str, known: Iterable[str], what: str) -> tuple[str, ...]:
    """One or two lines of help: the likely word, else the whole short list."""
    words = tuple(known)
    likely = nearest(word, words)
    if likely:
        return (f"did you mean `{likely}`?",)
    if 0 < len(words) <= 30:
        return (f"{what}: {', '.join(f'`{one}`' for one in sorted(words))}",)
    return ()
