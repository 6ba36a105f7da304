"""``swarmctl remove``: remove the swarm from its hosts."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import (
    console,
    executors,
    exit_codes,
    forgotten_lab,
    next_command,
    options,
    rollout_output,
    selected,
)


def remove(
    spec: options.Spec,
    overlays: options.Overlays = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask for confirmation.")] = False,
    stop_robots: options.StopRobots = False,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = 64,
    executor: executors.Executor = "",
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Remove the swarm from its hosts: stop the robots; remove units, links and /opt/swarm/<name>."""
    from swarmctl.deploy import journal, rollout
    from swarmctl.deploy.outcome import Removed
    from swarmctl.remote.parallel_hosts import interruptible

    swarm = console.read_spec(spec)
    names = selected.hosts(swarm.candidates, limit)
    if not yes and not _confirmed(swarm.name, names):
        console.fail("nothing was removed", "answer `yes`, or use --yes in scripts")
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    in_lab = options.in_lab(lab, lab_name)
    with (
        executors.transport(executor, in_lab=in_lab) as transport,
        interruptible(rollout_output.note) as stop,
    ):
        chosen = [targets[name] for name in names]
        events = rollout.remove(
            swarm.name, chosen, transport, parallel=parallel, stop=stop, stop_robots=stop_robots
        )
        found = rollout_output.results(events, names, quiet=json)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        where = next_command.where(lab=lab, lab_name=lab_name, limit=limit, executor=executor)
        rollout_output.report(
            swarm, found, next_command.completing(spec, where),
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    if not in_lab:
        forgotten_lab.guess("remove", spec, swarm.name, rollout_output.errors(found), limit)
        with rollout_output.journal_warnings():
            for name, result in found.items():
                if isinstance(result, Removed):
                    journal.forget(journal.folder(swarm.name), name)
    code = rollout_output.exit_code(found, interrupted=stop.requested)
    if not json and code not in (exit_codes.OK, exit_codes.INTERRUPTED):
        rollout_output.advise_again("remove", spec, found, lab=lab, lab_name=lab_name, executor=executor)
    raise typer.Exit(code)


def _confirmed(swarm: str, names: list[str]) -> bool:
    """Ask for confirmation on a terminal; False without one."""
    import sys

    if not (sys.stdin.isatty() and console.err().is_terminal):
        return False
    from swarmctl.yamltext import hostlist

    question = f"Remove swarm {swarm} from {hostlist.written(names)}? (yes)"
    return str(typer.prompt(question, default="no", err=True)) == "yes"
