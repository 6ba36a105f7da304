"""Slips of the keyboard in the text of a spec: keys and names misspelt, quotes, separators, digits, units.

Each mutation is a spec with one slip whose meaning is known: what the original says.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

Slip = Callable[[str, random.Random], str]


@dataclass(frozen=True)
class Mutation:
    """A text with one slip; ``what`` shows the word before and after."""

    kind: str
    what: str
    text: str


def mutations(text: str, seed: int, most: int) -> Iterator[Mutation]:
    """Yields up to ``most`` mutations of each kind, the same ones for the same seed."""
    for kind, (pattern, slip) in _KINDS.items():
        chance = random.Random(f"{seed} {kind}")
        places = [found for found in pattern.finditer(text) if not _in_comment(text, found.start(1))]
        for found in chance.sample(places, min(most, len(places))):
            word = found[1]
            other = slip(word, chance)
            if other != word:
                start, end = found.span(1)
                yield Mutation(kind, f"{word} -> {other}", text[:start] + other + text[end:])


def _in_comment(text: str, place: int) -> bool:
    return "#" in text[text.rfind("\n", 0, place) + 1 : place]


def dropped(word: str, chance: random.Random) -> str:
    """A letter is missing."""
    place = chance.randrange(1, len(word))
    return word[:place] + word[place + 1 :]


def doubled(word: str, chance: random.Random) -> str:
    """A letter is there twice."""
    place = chance.randrange(len(word))
    return word[:place] + word[place] + word[place:]


def swapped(word: str, chance: random.Random) -> str:
    """Two neighbours have changed places."""
    place = chance.randrange(len(word) - 1)
    return word[:place] + word[place + 1] + word[place] + word[place + 2 :]


def replaced(word: str, chance: random.Random) -> str:
    """One letter is another."""
    place = chance.randrange(1, len(word))
    return word[:place] + chance.choice("abcdefghijklmnopqrstuvwxyz") + word[place + 1 :]


def capitalised(word: str, chance: random.Random) -> str:
    """The word is in capitals, or begins with one."""
    return chance.choice([word.upper(), word.capitalize()])


def underscored(word: str, _: random.Random) -> str:
    """The separators are underscores."""
    return word.replace("-", "_")


def quoted(word: str, chance: random.Random) -> str:
    """A number or switch is text."""
    mark = chance.choice("\"'")
    return f"{mark}{word}{mark}"


def bare(word: str, _: random.Random) -> str:
    """What is in quotes or brackets is not any more."""
    return word[1:-1]


def other_switch(word: str, chance: random.Random) -> str:
    """A switch as older YAML wrote it."""
    return chance.choice(["yes", "on", "True", "Yes"] if word == "true" else ["no", "off", "False"])


def other_separator(word: str, chance: random.Random) -> str:
    """A Bluetooth address in another notation."""
    return word.replace(":", chance.choice(["-", "", "."]))


def thousandfold(word: str, chance: random.Random) -> str:
    """A length or speed in millimetres or centimetres."""
    return f"{float(word) * chance.choice([100, 1000]):g}"


_KEY = re.compile(r"(?<=[\s{,])([a-z][a-z_]{3,}):(?=\s)")
_NAME = re.compile(
    r"(?<=\s)(?:host|hub|leader|robot|by|type|computer|mode|root|provider): ([a-z][a-z0-9-]{2,})"
)
_IN_LIST = re.compile(r"(?:hosts|of|to): \[(?:[^\]]*, )?([a-z][a-z0-9-]{2,})(?=[,\]])")
_KINDS: dict[str, tuple[re.Pattern[str], Slip]] = {
    "key without a letter": (_KEY, dropped),
    "key with a letter twice": (_KEY, doubled),
    "key with letters swapped": (_KEY, swapped),
    "key with a wrong letter": (_KEY, replaced),
    "key in capitals": (_KEY, capitalised),
    "name without a letter": (_NAME, dropped),
    "name with a letter twice": (_NAME, doubled),
    "name with letters swapped": (_NAME, swapped),
    "name with a wrong letter": (_NAME, replaced),
    "name in capitals": (_NAME, capitalised),
    "name with underscores": (_NAME, underscored),
    "listed name without a letter": (_IN_LIST, dropped),
    "listed name with letters swapped": (_IN_LIST, swapped),
    "listed name in capitals": (_IN_LIST, capitalised),
    "kind misspelt": (re.compile(r"kind: ([a-z]+)"), swapped),
    "number in quotes": (re.compile(r": ([0-9]+(?:\.[0-9]+)?)(?=[,}\s])"), quoted),
    "number without quotes": (re.compile(r': ("[0-9]+")(?=[,}\s])'), bare),
    "switch of YAML 1.1": (re.compile(r": (true|false)(?=[,}\s])"), other_switch),
    "switch in quotes": (re.compile(r": (true|false)(?=[,}\s])"), quoted),
    "list without brackets": (re.compile(r": (\[[a-z0-9-]+\])"), bare),
    "address in another notation": (re.compile(r'"((?:[0-9a-fA-F]{2}:){5}[0-9a-fA-F]{2})"'), other_separator),
    "baud without a digit": (re.compile(r"baud: ([0-9]{4,})"), dropped),
    "baud with digits swapped": (re.compile(r"baud: ([0-9]{4,})"), swapped),
    "other unit": (re.compile(r"(?:linear|angular|wheel_separation): ([0-9.]+)"), thousandfold),
}
