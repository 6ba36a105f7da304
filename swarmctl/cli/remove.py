"""``swarmctl remove``: take the swarm off its hosts."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import access, carry_out, console


def remove(
    spec: access.Spec,
    overlays: access.Overlays = None,
    yes: Annotated[bool, typer.Option("--yes", "-y", help="Do not ask.")] = False,
    lab: access.Lab = False,
    lab_name: access.LabName = "",
    limit: access.Limit = None,
    parallel: access.Parallel = 64,
    json: access.Json = False,
) -> None:
    """Take the swarm off its hosts: robots stopped, units, links and /opt/swarm/<name> gone."""
    from swarmctl.deploy import journal, rollout
    from swarmctl.remote.fleet import interruptible
    from swarmctl.remote.ssh import SshTransport

    swarm = console.read_spec(spec)
    names = access.chosen(swarm.hosts, limit)
    if not yes and not _agreed(swarm.name, names):
        console.fail("nothing was removed", "answer `yes`, or give --yes where nobody can answer")
    targets = access.targets(spec, swarm, lab=lab, lab_name=lab_name)
    with interruptible(carry_out.say) as stop:
        chosen = [targets[name] for name in names]
        events = rollout.remove(swarm.name, chosen, SshTransport(), parallel=parallel, stop=stop)
        found = carry_out.results(events, names, quiet=json)
    if json:
        console.print_json(carry_out.document(swarm.name, found))
    else:
        carry_out.report(found)
    if not access.in_lab(lab, lab_name):
        with carry_out.journal_warnings():
            for name, result in found.items():
                if isinstance(result, rollout.Removed):
                    journal.forget(journal.folder(swarm.name), name)
    raise typer.Exit(carry_out.exit_code(found, interrupted=stop.requested))


def _agreed(swarm: str, names: list[str]) -> bool:
    """Ask on a terminal; where there is none, nobody agrees."""
    import sys

    if not (sys.stdin.isatty() and console.err().is_terminal):
        return False
    question = f"Remove swarm {swarm} from {', '.join(names)}? (yes)"
    return str(typer.prompt(question, default="no", err=True)) == "yes"
