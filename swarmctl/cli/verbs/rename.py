"""``swarmctl rename``: another name for a host, a robot, a program or a group, in all files of a spec."""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, file_writes, next_command, options

if TYPE_CHECKING:
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.spec.load import Document
    from swarmctl.swarm.renaming import Renaming

_SHOWN = 20  # mentions that are left


class Kind(str, Enum):
    """What has the name."""

    HOST = "host"
    ROBOT = "robot"
    PROGRAM = "program"
    GROUP = "group"


def rename(
    spec: options.Spec,
    old: Annotated[
        str, typer.Argument(metavar="OLD", help="The name to change.", autocompletion=complete.named)
    ],
    new: Annotated[str, typer.Argument(metavar="NEW", help="The new name.")],
    overlays: options.Overlays = None,
    kind: Annotated[
        Kind | None, typer.Option("--kind", help="What to rename, if things of two kinds have the name.")
    ] = None,
    write: Annotated[
        bool, typer.Option("--write", help="Write the files; by default the edit is only shown.")
    ] = False,
) -> None:
    """Rename a host, robot, program or group in all files of a spec. Comments and layout stay.

    The keys that are pinned for a host, and what this machine knows of its release, go along.
    """
    from swarmctl.swarm import renaming
    from swarmctl.views.escape import printable

    document = console.read_document(spec)
    try:
        made = renaming.rename(document, old, new, kind and kind.value)
        changes = [
            _change(Path(file), document.source.texts[file], text) for file, text in made.texts.items()
        ]
        if made.kind == Kind.HOST:
            changes += _pins(spec, document, made)
        after = _checked(spec, changes)
        made.check(document, after)
    except renaming.RenameError as error:
        console.fail(*error.args)
    if write:
        file_writes.write(changes)
        if made.kind == Kind.HOST:
            _rename_in_journal(document.spec.name, made)
        console.err().print(f"{spec}: {made.kind} `{old}` is called `{new}`")
        if made.kind == Kind.ROBOT:
            console.err().print(f"note: if `stop` holds `{old}`, hold `{new}` again after the next deploy")
    else:
        for line in "".join(map(file_writes.difference, changes)).split("\n")[:-1]:
            print(printable(line))
    _show_mentions(list(_mentions(spec, made, after)), old)
    if write:
        next_command.advise("plan", spec)
    else:
        more = ("--kind", kind.value) if kind else ()
        next_command.advise("rename", spec, old, new, *more, "--write")


def _checked(spec: SpecFiles, changes: list[file_writes.Change]) -> Document:
    """The spec with the new name; exits if it has errors, which it had not."""
    from swarmctl.cli.spec_fixes import SpecFixes
    from swarmctl.rulebook import Severity

    after, found = SpecFixes(spec).checked_with({one.file: one.after for one in changes})
    if after is None:
        errors = [f"{one.code}: {one.message}" for one in found.diagnostics if one.severity is Severity.ERROR]
        console.fail(f"{spec} would have errors after it, and was not changed", *errors)
    return after


def _change(path: Path, before: str, after: str) -> file_writes.Change:
    from swarmctl.yamltext.files import content

    return file_writes.Change(content(path), str(path), before, after)


def _pins(spec: SpecFiles, document: Document, made: Renaming) -> Iterator[file_writes.Change]:
    """Yields how the files with the pinned keys change; exits if the new name is that of a host that left."""
    from swarm_onboard.tunnel import keys

    from swarmctl.cli import pin_file
    from swarmctl.cli.ssh_targets import read_known_hosts
    from swarmctl.deploy import journal
    from swarmctl.remote.known_hosts import path_beside

    swarm = document.spec.name
    if made.new in journal.left(journal.folder(swarm), document.spec.hosts):
        console.fail(
            f"a host `{made.new}` has left the spec and still has its release",
            f"remove it from there: `{spec.command('remove', '--orphans', '--limit', made.new)}`",
        )
    known, pins = read_known_hosts(spec.first), pin_file.read(spec, swarm, "")
    port = document.spec.hosts[made.old].port
    texts = {
        path_beside(spec.first): (known.dump(), known.renamed(made.old, made.new, port).dump()),
        pins.path: (pins.text, keys.renamed(pins.text, made.old, made.new)),
    }
    for path, (before, after) in texts.items():
        if before != after:
            yield file_writes.Change(path.read_bytes(), str(path), before, after)


def _rename_in_journal(swarm: str, made: Renaming) -> None:
    from swarmctl.deploy import build_store, journal

    platforms = build_store.known_platforms(swarm, "")
    try:
        journal.rename(journal.folder(swarm), made.old, made.new)
        if made.old in platforms:
            named = {made.new if name == made.old else name: one for name, one in platforms.items()}
            build_store.remember_platforms(swarm, "", named, named)
    except OSError as error:
        console.fail(
            console.cannot_write(error, "the journal of deploys"), "the files of the spec have the new name"
        )


def _mentions(spec: SpecFiles, made: Renaming, after: Document) -> Iterator[str]:
    """Yields what still has the old name: texts of the spec, other YAML files beside it, files of programs
    and packages."""
    yield from map(str, made.mentions(after))
    folder = spec.first.parent
    known = {Path(file).resolve() for file in after.texts}
    others = [one for one in sorted(folder.glob("*.y*ml")) if one.resolve() not in known]
    contents = {str(path): path.read_bytes() for path in others if path.is_file()}
    contents |= {str(folder / path): content for path, content in after.files.content.items()}
    for package in after.packages.found:
        contents |= {f"{package.folder}/{path}": content for path, content in package.contents.items()}
    for file, content in contents.items():
        if not file.endswith((".wireguard", ".pem", ".p7s")):
            yield from map(str, made.mentions_in(file, content))


def _show_mentions(places: list[str], old: str) -> None:
    for place in places[:_SHOWN]:
        console.show(f"{place}: still mentions `{old}`", error=True)
    if len(places) > _SHOWN:
        console.show(f"and {len(places) - _SHOWN} more places", error=True)
