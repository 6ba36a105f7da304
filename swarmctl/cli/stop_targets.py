"""The robots of a spec by host, and how to reach these, for `stop` and `start`: read fast, despite errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from swarmctl.cli import console, selected

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.spec.reach import Reach


def read(spec: SpecFiles) -> Reach:
    """Returns the hosts of a spec; exits with its errors if it does not even name a swarm."""
    from swarmctl.spec.reach import reach_of

    found, wrong = reach_of(spec.files)
    if found is None:
        console.print_diagnostics(wrong)
        console.fail(f"{spec.first} names no swarm", "`swarmctl validate` shows what is wrong with it")
    return found


def warn_of_errors(spec: SpecFiles) -> None:
    """Prints how many errors the spec has. It reads all of it, which takes long, so robots stop first."""
    from swarmctl.linter.runner import check_files
    from swarmctl.rulebook import Severity

    _, found = check_files(*spec.files, workspaces=spec.workspaces)
    if number := sum(one.severity is Severity.ERROR for one in found.diagnostics):
        errors, them = ("1 error", "it") if number == 1 else (f"{number} errors", "them")
        console.err().print(
            f"warning: {spec.first} has {errors}, and what could be read of it was used; "
            f"`{spec.command('validate')}` shows {them}"
        )


def by_host(reach: Reach, chosen: Sequence[str] | None) -> tuple[dict[str, list[str]], list[str]]:
    """Returns the selected robots by host, and those for which no host can be reached."""
    found: dict[str, list[str]] = {}
    without = []
    for name in selected.robots(reach.candidates, chosen or [], "ROBOT"):
        host = reach.candidates.robots[name].host
        if host in reach.hosts:
            found.setdefault(str(host), []).append(name)
        else:
            without.append(name)
    return found, without
