"""What a kind of fault is: a name, what it needs to know, how it begins and how it ends.

The help of the command line lists the kinds, so this imports no plan of a lab before a fault is made.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from swarmctl.lab.hosts import inside
from swarmctl.lab.paths import LabPaths, lab_paths

if TYPE_CHECKING:
    from swarmctl.lab.lab_plan import LabPlan


@dataclass(frozen=True)
class RunningLab:
    """A lab that runs: what it was booted from, and its files."""

    plan: LabPlan
    files: LabPaths

    def in_host(self, host: str, script: str) -> str:
        """Runs a shell script as root on a host. Raises ``LabError`` if it fails or the host is off."""
        return inside.run(self.files, host, script)

    def ask(self, verb: str, subject: str) -> None:
        """Sends a request to the supervisor. Raises ``LabError`` if it is refused."""
        from swarmctl.lab import supervisor_client  # noqa: PLC0415  (large)

        supervisor_client.command(self.files, verb, subject)

    def hosts(self) -> dict[str, Any]:
        """Returns the supervisor's report on each host. Raises ``LabError`` if the lab is not running."""
        from swarmctl.lab import supervisor_client  # noqa: PLC0415  (large)

        found: dict[str, Any] = supervisor_client.running(self.files)["hosts"]
        return found


def running_lab(name: str) -> RunningLab:
    """Returns the lab of that name. Raises ``LabError`` if it is not up or not running."""
    from swarmctl.lab import supervisor_client  # noqa: PLC0415  (large)
    from swarmctl.lab.lab_state import read_state  # noqa: PLC0415  (large)

    files = lab_paths(name)
    supervisor_client.running(files)
    return RunningLab(read_state(files).plan, files)


@dataclass(frozen=True)
class FaultOption:
    """The one option of a kind. ``read`` raises ``ValueError`` with what the value must be."""

    name: str
    metavar: str
    help: str
    read: Callable[[str], Any] = str
    needed: bool = True


@dataclass(frozen=True)
class FaultKind:
    """One kind of fault.

    ``begin`` gets the target and the option's value (None without one), and returns what is true now of the
    target. ``end`` gets targets of any state: it does nothing to those without this fault.
    """

    name: str
    help: str
    begin: Callable[[RunningLab, str, Any], str]
    end: Callable[[RunningLab, Sequence[str]], None]
    of_robots: bool = False
    option: FaultOption | None = None

    def read(self, text: str | None) -> Any:
        """Reads the value of the option; ``text`` is None without one. Raises ``ValueError``."""
        if self.option is None or text is None:
            return None
        try:
            return self.option.read(text)
        except ValueError as error:
            raise ValueError(f"--{self.option.name} `{text}`: {error}") from None


def scripted(
    name: str,
    help: str,  # noqa: A002
    begin: Callable[[Any], str],
    end: str,
    *,
    outcome: Callable[[Any], str],
    option: FaultOption | None = None,
) -> FaultKind:
    """Returns a kind whose beginning and end are shell scripts, run as root on the host."""

    def begins(lab: RunningLab, host: str, value: Any) -> str:
        lab.in_host(host, begin(value))
        return outcome(value)

    def ends(lab: RunningLab, hosts: Sequence[str]) -> None:
        for host in hosts:
            if inside.first_process(lab.files, host) is not None:
                lab.in_host(host, end)

    return FaultKind(name, help, begins, ends, option=option)
