"""The command of a middleware that lists, shows, measures and publishes topics, as text for a host. Pure."""

from __future__ import annotations

import re
import shlex
from base64 import b64encode
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from swarmctl.onboard_archive import archive_of
from swarmctl.render.bundle import ROOT

NO_RELEASE, NO_TOOL = 126, 127  # the exit codes of a host that lacks them
END_OF_MESSAGE = "---"  # the line that follows each message of `echo`
#: Imports from an archive in memory. It has no single quote: each would be five characters in every shell.
_LOADER = (
    'import base64, os, sys; file = os.memfd_create("swarm"); os.write(file, base64.b64decode("{archive}")); '
    'sys.path[0] = "/proc/self/fd/%d" % file; from {module} import main; main()'
)
_LISTED = re.compile(r" \* (\S+) \[(.*)\] (\d+) (publisher|subscriber)s?")


@dataclass(frozen=True)
class TopicTool:
    """A command with the verbs ``list -v``, ``echo``, ``hz`` and ``pub``.

    ``package`` is the ROS package that it needs, and the Python module.
    """

    words: tuple[str, ...]
    package: str

    def list(self) -> tuple[str, ...]:
        """Returns the command whose output ``listed`` reads."""
        return (*self.words, "list", "-v")

    def echo(self, topic: str) -> tuple[str, ...]:
        """Returns the command that prints messages, each with ``END_OF_MESSAGE`` after it."""
        return (*self.words, "echo", topic)

    def hz(self, topic: str) -> tuple[str, ...]:
        """Returns the command that prints the rate of a topic, Hz, every second."""
        return (*self.words, "hz", topic)

    def pub(self, topic: str, kind: str, values: str, *, rate: float | None, once: bool) -> tuple[str, ...]:
        """Returns the command that publishes a message of YAML, at ``rate`` in Hz or as the tool does."""
        often = ("-r", f"{rate:g}") if rate is not None else ("-1",) if once else ()
        return (*self.words, "pub", *often, "--", topic, kind, values)  # values such as -1 are no option

    def line(self, swarm: str, words: Sequence[str]) -> str:
        """Returns the line for a host's shell that runs ``words`` in the ROS of its release."""
        return shlex.join(("bash", "-c", in_release(swarm, self.package, words)))


def sent(module: str) -> tuple[str, ...]:
    """Returns the words that run ``main`` of an on-robot module, which they bring with what it imports."""
    archive = b64encode(archive_of((module,))).decode("ascii")
    return "python3", "-c", _LOADER.format(archive=archive, module=module)


def in_release(swarm: str, package: str, words: Sequence[str]) -> str:
    """Returns the script for bash that becomes ``words`` in the ROS of the host's release.

    It exits with ``NO_RELEASE``, or with ``NO_TOOL`` where Python finds no ``package``.
    """
    setup = shlex.quote(f"{ROOT}/{swarm}/current/setup.bash")
    found = f"import importlib.util as i; raise SystemExit(i.find_spec({package!r}) is None)"
    return (
        f"[ -r {setup} ] || exit {NO_RELEASE}; . {setup}; "
        f"python3 -c {shlex.quote(found)} || exit {NO_TOOL}; "
        f"PYTHONUNBUFFERED=1 exec {shlex.join(words)}"
    )


@dataclass(frozen=True)
class Listed:
    """A topic with its type, and how many nodes publish it and subscribe to it."""

    topic: str
    type: str
    publishers: int = 0
    subscribers: int = 0


def listed(text: str) -> Iterator[Listed]:
    """Yields the topics in what ``list -v`` has printed, in the order of their names."""
    types, counts = dict[str, str](), dict[tuple[str, str], int]()
    for line in text.splitlines():
        if found := _LISTED.fullmatch(line):
            topic, kind, count, role = found.groups()
            types[topic] = kind
            counts[topic, role] = int(count)
    for topic in sorted(types):
        yield Listed(
            topic, types[topic], counts.get((topic, "publisher"), 0), counts.get((topic, "subscriber"), 0)
        )
