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


def nearest(word: str, known: tuple[str, ...]) -> str | None:
    """Returns the most similar name of ``known``, or None; of very many, one that differs by a letter."""
    if len(known) > _MANY:
        index = _by_shape(known)
        known = tuple(dict.fromkeys(one for shape in _shapes(word) for one in index.get(shape, ())))
    return _closest(word, known)


@lru_cache(maxsize=4096)  # one wrong name may stand in ten thousand places
def _closest(word: str, known: tuple[str, ...]) -> str | None:
    if (other := _OTHER_WORDS.get(word)) in known:
        return other
    found = difflib.get_close_matches(word, known, n=1, cutoff=_NEAR)
    return found[0] if found else None


@lru_cache(maxsize=4)
def _by_shape(known: tuple[str, ...]) -> dict[str, list[str]]:
    """Words by their shapes: comparing each wrong name of a large spec with all others takes minutes."""
    index: dict[str, list[str]] = {}
    for word in known:
        for shape in _shapes(word):
            index.setdefault(shape, []).append(word)
    return index


def _shapes(word: str) -> tuple[str, ...]:
    """``word``, and what is left of it without one letter: words a letter apart have one in common."""
    return tuple({word: None} | {word[:place] + word[place + 1 :]: None for place in range(len(word))})


def did_you_mean(word: str, known: Iterable[str], what: str) -> tuple[str, ...]:
    """Returns one or two lines of help: the likely word, else the whole short list."""
    words = tuple(known)
    likely = nearest(word, words)
    if likely:
        return (f"did you mean `{likely}`?",)
    if 0 < len(words) <= 30:
        return (f"{what}: {', '.join(f'`{one}`' for one in sorted(words))}",)
    return ()
