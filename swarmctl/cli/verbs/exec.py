"""``swarmctl exec``: runs a command on hosts, and prints what they printed."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, options, selected, stop_targets
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.remote.host_commands import Ran
    from swarmctl.spec.selection_candidates import Candidates

_EVERY = "all"


@with_where("parallel", overlays=options.LongOverlays)
def exec(  # noqa: A001  (the verb is called so)
    where: Where,
    selection: Annotated[
        str,
        typer.Argument(
            metavar="SELECTION",
            help="The hosts, or those of these robots: pi-*, k3,koala, @group, type:epuck2, !k3, all.",
            autocompletion=complete.selections,
        ),
    ],
    command: Annotated[
        list[str],
        typer.Argument(
            metavar="COMMAND", help="After `--`: one word is a shell line, several stay as they are."
        ),
    ],
    follow: Annotated[
        bool, typer.Option("--follow", "-f", help="Print each line as it comes, after the name of its host.")
    ] = False,
    json: options.Json = False,
) -> None:
    """Run a command on hosts, at once. Prints what they printed, equal output once.

    If it fails: with the command's exit code, if all that failed have the same. Ctrl-C ends it on the hosts.
    """
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.remote import host_commands
    from swarmctl.remote.parallel_hosts import Finished, Note
    from swarmctl.views import command_output as view

    if follow and json:
        console.fail("--follow and --json exclude each other", code=exit_codes.USAGE)
    reach = stop_targets.read(where.spec)
    names = _chosen(reach.candidates, selection, command, reach.hosts)
    targets = where.targets(reach)
    found: dict[str, Ran] = {}
    events = host_commands.run(
        [targets[name] for name in names], host_commands.shell_command(command), transport(become=False),
        parallel=where.parallel, follow=follow,
    )  # fmt: skip
    hint = where.complete
    interrupted = False
    with console.err().status(f"0 of {len(names)} hosts are done") as progress:
        if follow or not console.err().is_terminal:
            progress.stop()
        try:
            for event in events:
                if isinstance(event, Note):
                    console.out().print(view.followed(event.host, event.text))
                elif isinstance(event, Finished):
                    found[event.host] = host_commands.ran(event)
                    progress.update(f"{len(found)} of {len(names)} hosts are done")
        except KeyboardInterrupt:
            interrupted = True
    results = [found[name] for name in names if name in found]
    if json:
        hosts = [_entry(one) for one in results]
        console.print_json({"v": 1, "swarm": reach.name, "hosts": hosts})
    elif text := view.results([one for one in results if not (follow and one.status == 0)], hint):
        console.out().print(text)
    if interrupted:
        _say_interrupted([name for name in names if name not in found])
    elif not (json or follow):
        where.advise_doctor({one.host: one.error for one in results if one.error})
    raise typer.Exit(exit_codes.INTERRUPTED if interrupted else exit_code(results))


def _chosen(
    known: Candidates, selection: str, command: Sequence[str], reached: Collection[str]
) -> Sequence[str]:
    """The selected hosts; exits with an error for none, and for one without an address."""
    from swarmctl.yamltext import hostlist

    if command[0] in known.hosts_and_robots:
        both = f"{selection},{command[0]}"
        console.fail(
            f"`{command[0]}` is no command", f"select several as one word: `{both}`", code=exit_codes.USAGE
        )
    every = selection == _EVERY and _EVERY not in known.hosts_and_robots
    names = selected.hosts(known, [] if every else [selection], "SELECTION")
    if without := [name for name in names if name not in reached]:
        console.fail(f"the spec has no address for {hostlist.written(without)}")
    return names


def exit_code(results: Sequence[Ran]) -> int:
    """That of the command, if all hosts that it failed on have the same, and none another error."""
    errors = [one.error for one in results if one.error]
    codes = {one.status for one in results if one.status}
    if errors:
        failed = codes or any(error.reached for error in errors)
        return exit_codes.HOSTS_FAILED if failed else exit_codes.HOSTS_UNREACHABLE
    return (codes.pop() or 0) if len(codes) == 1 else exit_codes.HOSTS_FAILED if codes else exit_codes.OK


def _entry(one: Ran) -> dict[str, object]:
    return {
        "host": one.host,
        "status": one.status,
        "stdout": one.stdout.decode("utf-8", "replace"),
        "stderr": one.stderr.decode("utf-8", "replace"),
        "error": one.error and one.error.to_json(),
    }


def _say_interrupted(left: Sequence[str]) -> None:
    from swarmctl.yamltext import hostlist

    console.show(f"interrupted: the command was ended on {hostlist.written(left)}", error=True)
