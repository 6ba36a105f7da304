"""``swarmctl deploy``: install the release of each host."""

from __future__ import annotations

import typer

from swarmctl.cli import console, options, rollout_output


def deploy(
    spec: options.Spec,
    overlays: options.Overlays = None,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = 64,
    json: options.Json = False,
) -> None:
    """Deploy the spec to its hosts. Only units that changed restart."""
    from swarmctl.deploy import journal, rollout
    from swarmctl.remote.parallel_hosts import interruptible
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.render.build_bundle import bundles

    swarm = console.read_spec(spec)
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in options.chosen(wanted, limit)}
    place = journal.folder(swarm.name)
    secrets = options.secrets(spec, wanted)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    with interruptible(rollout_output.note) as stop:
        events = rollout.deploy(
            wanted, targets, SshTransport(), parallel=parallel, stop=stop, secrets=secrets
        )
        found = rollout_output.results(events, list(wanted), quiet=json)
    absent = rollout_output.absent(found, swarm.hosts)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        rollout_output.report(found, absent)
    if not options.in_lab(lab, lab_name):
        done = [name for name, result in found.items() if isinstance(result, rollout.Outcome)]
        with rollout_output.journal_warnings():
            for name in done:
                journal.remember(place, name, wanted[name].digest, wanted[name].manifest)
            rollout_output.warn_of_removed_hosts(journal.left(place, swarm.hosts))
    raise typer.Exit(rollout_output.exit_code(found, interrupted=stop.requested, absent=absent))
