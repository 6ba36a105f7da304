"""``swarmctl report``: one archive of what is known of a swarm, without its secrets."""

from __future__ import annotations

import shlex
import time
from pathlib import Path
from typing import Annotated, Any

import typer

from swarmctl.cli import console, exit_codes, file_writes, options, report_parts, swarm_look
from swarmctl.cli.report_parts import Parts, lines_of, written
from swarmctl.cli.where import Where, with_where


@with_where("parallel")
def report(
    where: Where,
    output: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="FILE", help="Write this file instead of NAME-DATE-TIME.tar.gz."),
    ] = None,
    since: Annotated[
        str, typer.Option(metavar="TIME", help='Logs not before: 10m, 2h, 21:00, "2026-11-26 21:00".')
    ] = "",
) -> None:
    """Write one archive for those who help: spec, plan, status, logs and graph, without secrets.

    A host that does not answer costs only its own part. `swarmctl status --from FILE` shows the status again.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.cli.verbs.logs import start_of
    from swarmctl.health import report_archive
    from swarmctl.render.build_bundle import bundles
    from swarmctl.views import report as view

    start = start_of(since)
    expected = swarm_look.expected(where)
    now = time.localtime()
    folder = f"{expected.swarm.name}-{time.strftime('%Y%m%d-%H%M%S', now)}"
    file = output or Path(f"{folder}.tar.gz")
    if file.exists():
        console.fail(f"{file} exists already", "-o names another file")
    wanted = bundles(expected.swarm)
    secrets = where.secrets(wanted)
    unknown = sorted({name for bundle in wanted.values() for name in bundle.secrets} - secrets.keys())
    targets = where.targets(expected.swarm)
    parts = Parts(expected, targets, transport(), where.parallel, where.in_lab)
    clean = report_archive.remover(secrets)
    report_parts.say("status")
    look = parts.look(options.WINDOW)
    report_parts.say("logs")
    logs, runs = parts.logs(start), parts.runs()
    report_parts.say("plan")
    seen: dict[str, Any] = {
        "began": look.began,
        "took": look.took,
        "spec": [str(one) for one in where.spec.files],
        "where": where.options,
    }
    documents = {
        report_archive.STATUS: look.status.to_json(),
        report_archive.LOOK: seen,
        report_archive.MOTION: parts.motion(),
        "plan.json": parts.plan(wanted, secrets),
        "history.json": {"v": 1, "swarm": expected.swarm.name, "runs": runs},
        "versions.json": parts.versions(),
    }
    edits = parts.edits(wanted)
    readme = view.readme(
        expected.swarm.name, time.strftime("%Y-%m-%d %H:%M:%S %z", now), parts.missing, unknown
    )
    texts = {
        "README.txt": clean(readme),
        **{name: written(clean(document)) for name, document in documents.items()},
        **parts.drawn(clean),
        **clean(edits),
        report_archive.LOGS: lines_of(clean(logs)),
        **clean(parts.spec(where.spec.first.parent, [str(one) for one in where.spec.files[1:]])),
    }
    data = report_archive.packed(folder, texts, look.began)
    try:
        file_writes.create(file, data)
    except OSError as error:
        console.fail(console.cannot_write(error, file))
    for name, why in parts.missing.items():
        console.show(f"missing: {name}: {clean(why)}", error=True)
    if unknown:
        console.show(f"note: {view.secrets(unknown)}", error=True)
    console.show(f"{file}  {len(data) / 1e3:.0f} kB")
    console.show_next(shlex.join(["swarmctl", "status", "--from", str(file)]))
    raise typer.Exit(exit_codes.HOSTS_UNREACHABLE if parts.missing else exit_codes.OK)
