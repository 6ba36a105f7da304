"""``swarmctl deploy``: install the release of each host."""

from __future__ import annotations

from typing import Annotated

import typer

from swarmctl.cli import console, exit_codes, forgotten_lab, next_command, options, rollout_output, selected


def deploy(
    spec: options.Spec,
    overlays: options.Overlays = None,
    skip_unfit: Annotated[
        bool,
        typer.Option(
            "--skip-unfit",
            help="Change the other hosts even if one lacks what its part needs (see `prepare`).",
        ),
    ] = False,
    healthy_for: Annotated[
        float,
        typer.Option(
            "--healthy-for",
            min=0,
            max=300,
            metavar="SECONDS",
            help="Undo the change of a host whose units do not run for so long without a restart.",
        ),
    ] = 6.0,
    confirm_within: Annotated[
        float,
        typer.Option(
            "--confirm-within",
            min=10,
            max=3600,
            metavar="SECONDS",
            help="A host undoes its change unless a new connection confirms it within so long.",
        ),
    ] = 60.0,
    lab: options.Lab = False,
    lab_name: options.LabName = "",
    limit: options.Limit = None,
    parallel: options.Parallel = 64,
    details: options.Details = False,
    json: options.Json = False,
) -> None:
    """Deploy the spec to its hosts. Only units that changed restart; an unfit host stops all before that."""
    from swarmctl.deploy import journal, rollout
    from swarmctl.deploy.host_transaction import Terms
    from swarmctl.deploy.launch_files_on_hosts import launch_files_of
    from swarmctl.plan.preflight import PREPARE_INSTALLS
    from swarmctl.remote.parallel_hosts import interruptible
    from swarmctl.remote.ssh import SshTransport
    from swarmctl.render.build_bundle import bundles

    document = console.read_document(spec)
    swarm = console.swarm_of(document, options.lab_of(document, lab, lab_name))
    wanted = bundles(swarm)
    wanted = {name: wanted[name] for name in selected.hosts(swarm.candidates, limit)}
    where = next_command.where(lab=lab, lab_name=lab_name, limit=limit)
    place = journal.folder(swarm.name)
    secrets = options.secrets(spec, wanted)
    terms = Terms(healthy_for, max(30.0, 4 * healthy_for), confirm_within)
    targets = options.targets(spec, swarm, lab=lab, lab_name=lab_name)
    with interruptible(rollout_output.note) as stop:
        events = rollout.deploy(
            wanted, targets, SshTransport(), parallel=parallel, stop=stop, secrets=secrets,
            stopping=() if skip_unfit else {name for name in wanted if not swarm.hosts[name].optional},
            launch_files=launch_files_of(document), terms=terms,
        )  # fmt: skip
        found = rollout_output.results(events, list(wanted), quiet=json)
    absent = rollout_output.absent(found, swarm.hosts)
    if json:
        console.print_json(rollout_output.document(swarm.name, found))
    else:
        rollout_output.report(
            swarm, found, next_command.completing(spec, where), absent,
            details=details, interrupted=stop.requested,
        )  # fmt: skip
    if not options.in_lab(lab, lab_name):
        forgotten_lab.guess("deploy", spec, swarm.name, rollout_output.errors(found), limit)
        done = [name for name, result in found.items() if isinstance(result, rollout.Outcome)]
        with rollout_output.journal_warnings():
            for name in done:
                journal.remember(place, name, wanted[name].digest, wanted[name].manifest)
            rollout_output.warn_of_removed_hosts(journal.left(place, swarm.hosts), spec)
    code = rollout_output.exit_code(found, interrupted=stop.requested, absent=absent)
    lacking = rollout_output.unfit(found, PREPARE_INSTALLS)
    if not json and lacking:
        console.err().print(f"help: `{spec.command('prepare', *where)}` makes {lacking} fit")
    if not json and not skip_unfit and rollout_output.unfit(found):
        skipping = spec.command("deploy", *where, "--skip-unfit")
        console.err().print(f"help: `{skipping}` changes the other hosts without them")
    if not json and code == exit_codes.OK:
        next_command.advise("status", spec, *where)
    elif not json and code != exit_codes.INTERRUPTED and not lacking:
        rollout_output.advise_again("deploy", spec, found, absent, lab=lab, lab_name=lab_name)
    raise typer.Exit(code)
