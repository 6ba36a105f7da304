"""``swarmctl capsule``: checks and lists capsules, the folders that trials leave. Connects to no host."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import console, exit_codes, options

if TYPE_CHECKING:
    from collections.abc import Iterable

    from swarmctl.capsule.capsule_index import CapsuleError, Index

capsule = typer.Typer(
    name="capsule", no_args_is_help=True, help="Check and list capsules, the folders that trials leave."
)


@capsule.command(epilog=exit_codes.epilog())
def verify(
    folders: Annotated[list[Path], typer.Argument(metavar="FOLDER", help="Capsules.")],
    json: options.Json = False,
) -> None:
    """Check that each file of a capsule is as it was, and who signed that. Exit code 1 if one is not."""
    from swarmctl.views import capsule as view
    from swarmctl.views.escape import printable

    listed = []
    for folder in folders:
        signer, problems = _checked(folder)
        intact = not problems
        listed.append({"folder": str(folder), "intact": intact, "signer": signer, "problems": problems})
        if not json:
            console.show(f"{printable(str(folder))}  {view.verdict(signer, problems)}")
    if json:
        console.print_json({"v": 1, "capsules": listed})
    raise typer.Exit(exit_codes.OK if all(one["intact"] for one in listed) else exit_codes.ERROR)


def _checked(folder: Path) -> tuple[str, list[str]]:
    """The fingerprint of the key that signed a capsule, and what is wrong with it."""
    from swarmctl.capsule.capsule_index import CapsuleError
    from swarmctl.capsule.folder import problems
    from swarmctl.capsule.signature import signer

    try:
        found, signed = problems(folder), signer(folder)
    except CapsuleError as error:
        return "", [str(error)]
    return signed.fingerprint, [*found, *filter(None, [signed.problem])]


@capsule.command(epilog=exit_codes.epilog())
def show(
    folders: Annotated[
        list[Path],
        typer.Argument(metavar="FOLDER", help="Capsules, or folders with capsules at most two below."),
    ],
    json: options.Json = False,
) -> None:
    """List trials, and how many of each experiment were completed. Reads each index, and no other file."""
    from swarmctl.capsule.capsule_index import CapsuleError, Index
    from swarmctl.capsule.completion_rate import rates
    from swarmctl.views import capsule as view

    found = _found(folders)
    indexes = {folder: one for folder, one in found.items() if isinstance(one, Index)}
    errors = {folder: one for folder, one in found.items() if isinstance(one, CapsuleError)}
    rows = dict(sorted(indexes.items(), key=lambda row: (row[1].swarm, row[1].experiment, row[1].began)))
    counted = rates(rows.values())
    if json:
        experiments = [
            {"swarm": swarm, "experiment": name, **one._asdict(), "interval": one.interval()}
            for (swarm, name), one in counted.items()
        ]
        trials = [
            {"folder": str(folder), **one.model_dump(mode="json", exclude={"v", "files"})}
            for folder, one in rows.items()
        ]
        wrong = {str(folder): str(error) for folder, error in errors.items()}
        console.print_json({"v": 1, "trials": trials, "experiments": experiments, "errors": wrong})
    elif rows:
        console.out().print(view.trials(list(rows.values()), counted))
    for error in errors.values():
        console.show(f"error: {error}\n  help: {error.help}", error=True)
    raise typer.Exit(exit_codes.ERROR if errors else exit_codes.OK)


def _found(folders: Iterable[Path]) -> dict[Path, Index | CapsuleError]:
    """The index of each capsule, each once, or why it cannot be read."""
    from swarmctl.capsule.folder import below

    return {one: _read(one) for folder in folders for one in below(folder) or [folder]}


def _read(folder: Path) -> Index | CapsuleError:
    from swarmctl.capsule.capsule_index import CapsuleError
    from swarmctl.capsule.folder import read

    try:
        return read(folder)
    except CapsuleError as error:
        return error
