"""``swarmctl lab scenario``: causes the faults of a file one by one, and checks what status says of each."""

from __future__ import annotations

import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, lab_selection, options, swarm_look
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.health.fault_response import Look, Observer, Response
    from swarmctl.lab.scenario import Entry
    from swarmctl.remote.transport import Transport

_ERRORS = 3  # lines of the output of a repair that failed


def scenario(
    spec: options.Spec,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The scenario file.")],
    overlays: options.Overlays = None,
    name: lab_selection.Name = "",
    only: Annotated[
        list[str] | None,
        typer.Option("--only", metavar="TEXT", help="Only the faults with TEXT in their names (repeatable)."),
    ] = None,
    json: options.Json = False,
) -> None:
    """Cause the faults of a file one by one in a deployed lab, and check what status says of each."""
    from swarmctl.health.fault_response import Observer
    from swarmctl.views import tables as view

    entries = _entries(file, only or [])
    with lab_selection.errors(spec, name):
        lab = _Lab(spec, lab_selection.name_of(spec, name))
        deeds = [(entry, *lab.deeds(entry)) for entry in entries]
        with Where(spec, lab=True).transport() as transport:
            observer = Observer(_look(lab, transport), time.monotonic)
            found, problem = _responses(observer, deeds)
    good = not problem and all(one.as_expected for one in found)
    if json:
        console.print_json({"v": 1, "as_expected": good, "faults": [one.to_json() for one in found]})
    elif found:
        console.out().print(view.response_table(found))
    if problem:
        again = spec.command("lab repair", *(["--name", name] if name else []))
        console.fail(problem, f"`{again}` ends all faults of the lab", code=exit_codes.UNHEALTHY)
    raise typer.Exit(exit_codes.OK if good else exit_codes.UNHEALTHY)


def _entries(file: Path, only: list[str]) -> list[Entry]:
    """The entries of the file that ``--only`` chooses; exits with its errors, or without any."""
    from swarmctl.diagnostics import has_errors
    from swarmctl.lab.scenario import read_scenario

    entries, found = read_scenario(file)
    console.print_diagnostics(found)
    if has_errors(found):
        raise typer.Exit(exit_codes.ERROR)
    chosen = [one for one in entries if not only or any(text in one.name for text in only)]
    if not chosen:
        console.fail(f"no fault of {file} has {' or '.join(f'`{text}`' for text in only)} in its name")
    return chosen


Deed = Callable[[], None]


def _responses(observer: Observer, deeds: list[tuple[Entry, Deed, Deed]]) -> tuple[list[Response], str]:
    """The response to each fault, and why the run ended early; empty if it did not."""
    from swarmctl.lab.errors import LabError

    seen, whole = observer.until_healthy()
    if not whole:
        return [], f"the swarm is not healthy before the first fault: {seen.first}"
    found: list[Response] = []
    for number, (entry, begin, repair) in enumerate(deeds, 1):
        console.show(f"{number} of {len(deeds)}: {entry.name}", error=True)
        try:
            found.append(observer.response(entry.name, entry.first, entry.within, begin, repair))
        except LabError as error:
            return found, f"{entry.name}: {error}"
        if found[-1].recovered is None:
            return found, f"the swarm did not recover from the fault `{entry.name}`"
    return found, ""


def _look(lab: _Lab, transport: Transport) -> Callable[[], Look]:
    from swarmctl.health.fault_response import Look
    from swarmctl.health.verdict import State
    from swarmctl.views import status as view

    where = Where(lab.spec, lab=True, lab_name=lab.name)
    looking = swarm_look.looking(where, transport, options.WINDOW)

    def seen() -> Look:
        status = looking().status
        causes = (cause for cause, _ in status.causes() if cause.state is not State.SKIPPED)
        return Look(status.diagnosis.healthy, tuple(map(view.line, causes)))

    return seen


@dataclass(frozen=True)
class _Lab:
    """The lab of a scenario: what its entries do there."""

    spec: SpecFiles
    name: str

    def deeds(self, entry: Entry) -> tuple[Deed, Deed]:
        """What causes a fault and what repairs it; exits if its hosts or robots are not there."""
        if entry.fault is not None:
            return self._of_fault(entry.fault)
        assert entry.host is not None
        assert entry.run is not None
        return self._command(entry.host, entry.run), (
            self._verb(entry.swarmctl) if entry.undo is None else self._command(entry.host, entry.undo)
        )

    def _of_fault(self, line: str) -> tuple[Deed, Deed]:
        from swarmctl.lab import lab as labs
        from swarmctl.lab.faults import kinds

        words = kinds.read(line)
        find = lab_selection.robots if words.kind.of_robots else lab_selection.hosts
        _, targets = find(self.spec, self.name, list(words.selections))

        def begin() -> None:
            for target in targets:
                labs.fault(self.name, words.kind.name, target, words.value)

        def repair() -> None:
            hosts, robots = ([], targets) if words.kind.of_robots else (targets, [])
            labs.repair(self.name, lambda _: None, hosts, robots)

        return begin, repair

    def _command(self, host: str, script: str) -> Deed:
        from swarmctl.lab.faults.fault_kind import running_lab
        from swarmctl.lab.hosts import inside
        from swarmctl.lab.lab_addresses import OPERATOR

        lab = running_lab(self.name)
        if host == OPERATOR:
            return lambda: _ignore(inside.run_as_operator(lab.files, script))
        lab.plan.host(host)
        return lambda: _ignore(lab.in_host(host, script))

    def _verb(self, line: str | None) -> Deed:
        from swarmctl.lab.errors import LabError

        verb, *rest = shlex.split(line or "")
        words = shlex.split(self.spec.command(verb, "--lab-name", self.name, *rest))

        def run() -> None:
            argv = [sys.executable, "-m", "swarmctl", *words[1:]]
            done = subprocess.run(argv, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL)
            if done.returncode:
                output = (done.stderr or done.stdout).strip().splitlines()[-_ERRORS:]
                raise LabError(f"`swarmctl {line}` ended with exit code {done.returncode}", *output)

        return run


def _ignore(_: str) -> None:
    """Take the output of a command, which nobody reads."""
