"""``swarmctl deploy``: bring every host to what the spec says."""

from __future__ import annotations

import typer

from swarmctl.cli import access, carry_out, console


def deploy(
    spec: access.Spec,
    overlays: access.Overlays = None,
    lab: access.Lab = False,
    lab_name: access.LabName = "",
    limit: access.Limit = None,
    parallel: access.Parallel = 64,
    json: access.Json = False,
) -> None:
    """Bring every host to what the spec says. Only what changed restarts."""
    from swarmctl.deploy import journal, rollout
    from swarmctl.remote.fleet import interruptible
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.render.host import bundles

    swarm = console.read_spec(spec)
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in access.chosen(wanted, limit)}
    place = journal.folder(swarm.name)
    secrets = access.secrets(spec, wanted)
    targets = access.targets(spec, swarm, lab=lab, lab_name=lab_name)
    with interruptible(carry_out.say) as stop:
        events = rollout.deploy(
            wanted, targets, SshTransport(), parallel=parallel, stop=stop, secrets=secrets
        )
        found = carry_out.results(events, list(wanted), quiet=json)
    absent = carry_out.absent(found, swarm.hosts)
    if json:
        console.print_json(carry_out.document(swarm.name, found))
    else:
        carry_out.report(found, absent)
    if not access.in_lab(lab, lab_name):
        done = [name for name, result in found.items() if isinstance(result, rollout.Outcome)]
        with carry_out.journal_warnings():
            for name in done:
                journal.remember(place, name, wanted[name].digest, wanted[name].manifest)
            carry_out.tell_of_left(journal.left(place, swarm.hosts))
    raise typer.Exit(carry_out.exit_code(found, interrupted=stop.requested, absent=absent))
