"""Keys and names that are misspelt."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tests.mutations.defects import MISTAKES, Change, mistake, written
from tests.mutations.places import File, Place

_FLEET_NAMES = frozenset(("hub", *(f"cart-{number:02}" for number in range(1, 13))))  # used in another file
# Keys below these are names that the user chose, not words of the format.
_CHOSEN = (
    "hosts",
    "robots",
    "programs",
    "islands",
    "params",
    "remap",
    "environment",
    "rates",
    "sensors",
    "queries",
    "actuators",
)
REFERENCES = (
    *("leader", "hub", "time.root", "robots.*.host", "robots.*.type", "hosts.*.computer", "hosts.*.via"),
    *("links.*.host", "links.*.robot", "links.*.hosts.*", "programs.*.host", "programs.*.robot"),
    *("control.*.by", "control.*.of.*", "islands.*.leader", "islands.*.hub", "islands.*.hosts.*"),
)
_WORDS = (
    *("mode", "links.*.kind", "ros.distro", "multimaster.provider", "programs.*.use"),
    *("protocol.kind", "sensors.*.kind", "link.kinds.*", "sensors.*.radiation", "islands.*.mode"),
)


def _dropped(word: str) -> str:
    return word[: len(word) // 2] + word[len(word) // 2 + 1 :]


def _doubled(word: str) -> str:
    middle = len(word) // 2
    return word[:middle] + word[middle] + word[middle:]


def _exchanged(word: str) -> str:
    for at in range(len(word) // 2, 0, -1):
        if word[at] != word[at - 1]:
            return word[: at - 1] + word[at] + word[at - 1] + word[at + 1 :]
    return word


def _neighbour(word: str) -> str:
    """Returns the word with one letter that lies beside the right one on a keyboard."""
    rows = ("qwertyuiop", "asdfghjkl", "zxcvbnm")
    for at in range(len(word) // 2, len(word)):
        for row in rows:
            if word[at] in row[:-1]:
                return word[:at] + row[row.index(word[at]) + 1] + word[at + 1 :]
    return word


def _other_separator(word: str) -> str:
    return word.replace("_", "-") if "_" in word else word.replace("-", "_")


def _plural(word: str) -> str:
    return word.removesuffix("s") if word.endswith("s") else word + "s"


SLIPS: dict[str, Callable[[str], str]] = {
    "a letter is missing": _dropped,
    "a letter is doubled": _doubled,
    "two letters are exchanged": _exchanged,
    "the key beside was hit": _neighbour,
    "the first letter is a capital": str.capitalize,
    "hyphen and underscore are confused": _other_separator,
}


def _is_word_of_format(key: Place) -> bool:
    return len(key.loc) < 2 or key.loc[-2] not in _CHOSEN


def _keys(slip: Callable[[str], str]) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        for key in file.names():
            word = str(key.loc[-1])
            if _is_word_of_format(key) and len(word) > 2 and slip(word) != word:
                yield written(file, key, slip(word))

    return changes


def _scalars(places: tuple[str, ...], slip: Callable[[str], str]) -> Callable[[File], Iterator[Change]]:
    def changes(file: File) -> Iterator[Change]:
        for place in file.scalars(*places):
            if place.value and place.plain and len(place.value) > 2 and slip(place.value) != place.value:
                yield written(file, place, slip(place.value))

    return changes


def _definitions(slip: Callable[[str], str]) -> Callable[[File], Iterator[Change]]:
    """A host, robot or program is defined under another name than the one that is used elsewhere."""

    def changes(file: File) -> Iterator[Change]:
        used = {one.value for one in file.scalars(*REFERENCES)} | _FLEET_NAMES
        for key in file.names("hosts.*", "robots.*", "programs.*"):
            word = str(key.loc[-1])
            if word in used and len(word) > 2 and slip(word) != word:
                yield written(file, key, slip(word), words=(word,))

    return changes


for _title, _slip in SLIPS.items():
    MISTAKES[f"a key: {_title}"] = _keys(_slip)
    MISTAKES[f"a name: {_title}"] = _scalars(REFERENCES, _slip)
    MISTAKES[f"a word of the format: {_title}"] = _scalars(_WORDS, _slip)
    if "capital" not in _title and "confused" not in _title:
        MISTAKES[f"a definition: {_title}"] = _definitions(_slip)


@mistake("a key in the singular or plural")
def _plurals(file: File) -> Iterator[Change]:
    for key in file.names():
        word = str(key.loc[-1])
        if _is_word_of_format(key) and len(word) > 2:
            yield written(file, key, _plural(word))


@mistake("a name of something else of the swarm")
def _other_kind(file: File) -> Iterator[Change]:
    """A robot where a host belongs, a host where a robot belongs."""
    hosts = [str(one.loc[1]) for one in file.names("hosts.*") if "[" not in str(one.loc[1])]
    robots = [str(one.loc[1]) for one in file.names("robots.*") if "[" not in str(one.loc[1])]
    for place in file.scalars("robots.*.host", "links.*.host", "leader", "hub", "time.root", "islands.*.hub"):
        for robot in robots[-1:]:
            yield written(file, place, robot)
    for place in file.scalars("links.*.robot", "control.*.of.*", "programs.*.robot"):
        for host in hosts[-1:]:
            yield written(file, place, host)


@mistake("another host of the swarm")
def _other_host(file: File) -> Iterator[Change]:
    hosts = [str(one.loc[1]) for one in file.names("hosts.*") if "[" not in str(one.loc[1])]
    for place in file.scalars("robots.*.host", "links.*.host"):
        others = [host for host in hosts if host != place.value]
        if others:
            yield written(file, place, others[0], words=(_robot_of(file, place),))


def _robot_of(file: File, place: Place) -> str:
    if place.loc[0] == "robots":
        return str(place.loc[1])
    return next((str(one.value) for one in file.scalars("links.*.robot") if one.loc[1] == place.loc[1]), "\0")


@mistake("another robot of the swarm")
def _other_robot(file: File) -> Iterator[Change]:
    robots = [str(one.loc[1]) for one in file.names("robots.*") if "[" not in str(one.loc[1])]
    for place in file.scalars("links.*.robot"):
        others = [robot for robot in robots if robot != place.value]
        if others and place.value:
            yield written(file, place, others[0], words=(place.value, others[0]))
