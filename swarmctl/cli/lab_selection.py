"""The lab that a verb means, and its hosts and robots that selections choose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, next_command, selected
from swarmctl.cli.spec_args import SpecFiles

if TYPE_CHECKING:
    from swarmctl.spec.selection_candidates import Candidates


Name = Annotated[
    str, typer.Option("--name", metavar="NAME", help="The name of the lab; by default that of the swarm.")
]


@contextmanager
def errors(spec: SpecFiles | None, name: str) -> Iterator[None]:
    """Exit with message and help for an error of the lab of ``spec``, or of the one called ``name``."""
    from swarmctl.lab.errors import LabError

    try:
        yield
    except LabError as error:
        lines = next_command.in_lab_errors(error.help_lines, spec, name) if spec else error.help_lines
        console.fail(str(error), *lines)


def name_of(spec: SpecFiles | None, name: str) -> str:
    """The name of the lab; the spec is read only without a given name, but it must be there."""
    return name if spec is None or (name and spec.first.exists()) else console.read_spec(spec).name


def candidates(spec: SpecFiles, name: str, selections: Sequence[str]) -> tuple[str, Candidates]:
    """The name of the lab and what selections can name; exits if the spec has errors.

    The spec is not read if ``name`` is given and all selections are names or ranges of hosts and robots that
    this lab has. Raises ``LabError``.
    """
    from swarmctl.lab import lab as labs
    from swarmctl.lab.lab_plan import candidates_of, names_all

    if name:
        known = candidates_of(labs.plan(name))
        if names_all(known, selections):
            return name, known
    swarm = console.read_spec(spec)
    return name or swarm.name, swarm.candidates


def robots(spec: SpecFiles, name: str, selections: list[str]) -> tuple[str, list[str]]:
    """The name of the lab, and its selected robots with cables; exits without any. Raises ``LabError``."""
    from swarmctl.lab import lab as labs

    which, known = candidates(spec, name, selections)
    found = selected.robots(known, selections, "ROBOT")
    return which, there(which, found, [one.name for one in labs.plan(which).robots], "cable of ")


def hosts(
    spec: SpecFiles, name: str, selections: list[str], network: str = "", option: str = "HOST"
) -> tuple[str, list[str]]:
    """The same for hosts. If several are selected, those outside ``network`` are left out."""
    from swarmctl.lab import lab as labs

    which, known = candidates(spec, name, selections)
    found = selected.hosts(known, selections, option)
    plan = labs.plan(which)
    booted = there(which, found, [one.name for one in plan.hosts])
    on = [one for one in booted if not network or network in {at.network for at in plan.host(one).interfaces}]
    return which, on or booted[:1]  # the lab names the networks of a host that is not on this one


def hosts_and_robots(
    spec: SpecFiles, name: str, selections: list[str]
) -> tuple[str, list[str] | None, list[str] | None]:
    """The name of the lab, its selected hosts with their robots, and its selected robots; None means all."""
    from swarmctl.lab import lab as labs

    if not selections:
        return name_of(spec, name), None, None
    which, known = candidates(spec, name, selections)
    plan = labs.plan(which)
    chosen_hosts, chosen_robots = selected.hosts_and_robots(known, selections, "TARGET")
    booted = [one.name for one in plan.hosts]
    there(which, [*chosen_hosts, *(known.robots[one].host or "" for one in chosen_robots)], booted)
    robots_there = {one.name for one in plan.robots}
    return (
        which,
        [one for one in chosen_hosts if one in booted],
        [one for one in chosen_robots if one in robots_there],
    )


def there(lab_name: str, chosen: list[str], known: list[str], what: str = "") -> list[str]:
    """Those of ``chosen`` that a lab of a part of the swarm has; prints a note on the others."""
    from swarmctl.yamltext import hostlist

    found = [one for one in chosen if one in known]
    lacking = hostlist.written(one for one in chosen if one not in known)
    if not found:
        has = f"{what and 'those of '}{hostlist.written(known)}" if known else "none"
        console.fail(f"lab {lab_name} has no {what}{lacking}", f"it has {has}")
    if lacking:
        console.show(f"note: lab {lab_name} has no {what}{lacking}", error=True)
    return found
