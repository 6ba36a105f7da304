"""Did you mean: the nearest of a closed set of words, and whether another could be meant."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from functools import lru_cache

_MANY = 500
MOST_NEAR = 3  # more equally near words are no suggestion
_FARTHEST = 4
_SHORTEST = 4  # letters of a word in which another letter leaves no doubt; one less for other slips
_SEPARATORS = re.compile("[-_. ]")
_PARTS = re.compile("[-_. /]")
_DIGITS = re.compile("[0-9]+")

# What people write first, where the spec uses another word; of several, the one that is known there.
_OTHER_WORDS = {
    "hostname": "address",
    "ip": "address",
    "username": "user",
    "ansible_host": "address",
    "ansible_user": "user",
    "ansible_port": "port",
    "ip_address": "address",
    "mac_address": "mac",
    "serial_number": "serial",
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
    "parameters": "settings params",
    "node": "executable",
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
    "rs232": "serial",
    "usb": "serial",
    "env": "environment",
    "pkg": "package",
}
# Keys of other tools that only look like keys of the spec.
FOREIGN = frozenset({"master_uri", "ros_master_uri"})
# Those of them that mean nothing else.
_SYNONYMS = frozenset(
    {
        "username",
        "login",
        "baudrate",
        "vid",
        "pid",
        "bdaddr",
        "wifi",
        "wireless",
        "rfcomm",
        "bt",
        "ansible_host",
        "ansible_user",
        "ansible_port",
        "ip_address",
        "mac_address",
        "serial_number",
    }
)


@dataclass(frozen=True)
class Guess:
    """The words that are nearest to a wrong one; several are equally near, and none may be.

    It is ``certain`` if there is one, a typing error away, and no other is plausible.
    """

    words: tuple[str, ...] = ()
    certain: bool = False

    @property
    def only(self) -> str | None:
        """The nearest word, or None if several are equally near."""
        return self.words[0] if len(self.words) == 1 else None


def guess(word: str, known: Iterable[str]) -> Guess:
    """Returns what ``word`` was probably meant to be; of very many, only a word that differs by a letter."""
    words = tuple(known)
    if len(words) > _MANY:
        index = _by_shape(words)
        words = tuple(dict.fromkeys(one for shape in _shapes(word) for one in index.get(shape, ())))
    return _guess(word, words)


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Returns the most similar of ``known``, or None if there is none, or several are equally similar."""
    return guess(word, known).only


def typing_errors(word: str, other: str) -> int:
    """Returns how many letters are wrong, missing, additional or swapped, without case and separators."""
    from rapidfuzz.distance import OSA  # noqa: PLC0415  (40 modules, and most specs have no wrong word)

    return OSA.distance(_bare(word), _bare(other))


def is_near(word: str, other: str) -> bool:
    """Returns True if ``word`` may be ``other`` misspelt."""
    return typing_errors(word, other) <= min(max(len(word), len(other)) // 3, _FARTHEST)


@lru_cache(maxsize=4096)  # one wrong name may stand in ten thousand places
def _guess(word: str, known: tuple[str, ...]) -> Guess:
    if word in known or word.lower() in FOREIGN:
        return Guess()
    other = next((one for one in _OTHER_WORDS.get(word, "").split() if one in known), None)
    if other is not None:
        return Guess((other,), word in _SYNONYMS or typing_errors(word, other) == 1)
    errors = {one: typing_errors(word, one) for one in known if is_near(word, one)}
    longer = tuple(one for one in known if one.startswith((f"{word}-", f"{word}_")))
    least = min(errors.values(), default=_FARTHEST)
    if not errors or (longer and least > 1):
        return Guess(longer) if len(longer) <= MOST_NEAR else Guess()
    best = tuple(one for one, count in errors.items() if count == least)
    if len(best) > MOST_NEAR:
        return Guess()
    digits = _DIGITS.findall(word)
    rivals = [
        one for one in known if _DIGITS.findall(one) == digits and typing_errors(word, one) == least + 1
    ]
    return Guess(best, len(best) == 1 and not rivals and least <= 1 and _is_slip(word, best[0]))


def _is_slip(word: str, meant: str) -> bool:
    """True for an error in typing; another digit or another short part is probably another thing."""
    if _bare(word) == _bare(meant):
        return True
    if _DIGITS.findall(word) != _DIGITS.findall(meant):
        return False
    same_letters = sorted(_bare(word)) == sorted(_bare(meant))
    enough = _SHORTEST if len(word) == len(meant) and not same_letters else _SHORTEST - 1
    parts, others = _PARTS.split(word), _PARTS.split(meant)
    return len(parts) == len(others) and all(
        one == other or len(other) >= enough for one, other in zip(parts, others, strict=True)
    )


def _bare(word: str) -> str:
    return _SEPARATORS.sub("", word.lower())


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
    """Returns one or two lines of help: the likely words, else the whole short list."""
    words = tuple(known)
    return suggestion(guess(word, words), words, what)


def suggestion(meant: Guess, words: Collection[str], what: str) -> tuple[str, ...]:
    """Returns the same help for what is already guessed."""
    if meant.words:
        return (f"did you mean {' or '.join(f'`{one}`' for one in meant.words)}?",)
    if 0 < len(words) <= 30:
        return (f"{what}: {', '.join(f'`{one}`' for one in sorted(words))}",)
    return ()
