"""``swarmctl capsule``: checks, lists, compares and exports capsules, which trials leave. Offline."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from swarmctl.cli import console, exit_codes, extras, file_writes, options

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from swarmctl.capsule.capsule_index import CapsuleError, Index
    from swarmctl.capsule.trajectory import Sample

capsule = typer.Typer(
    name="capsule",
    no_args_is_help=True,
    help="Check, list, compare and export capsules, the folders that trials leave.",
)

_Folders = Annotated[
    list[Path],
    typer.Argument(metavar="FOLDER", help="Capsules, or folders with capsules at most two below."),
]


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
def show(folders: _Folders, json: options.Json = False) -> None:
    """List trials, and how many of each experiment were completed. Reads each index, and no other file."""
    from swarmctl.capsule.completion_rate import rates
    from swarmctl.views import capsule as view

    indexes, errors = _found(folders)
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
        console.print_json({"v": 1, "trials": trials, "experiments": experiments, "errors": _texts(errors)})
    elif rows:
        console.out().print(view.trials(list(rows.values()), counted))
    _end(errors)


@capsule.command(epilog=exit_codes.epilog())
def compare(
    folders: _Folders,
    plot: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="Draw trajectories and speeds, from the bags: FILE.svg or FILE.png."
        ),
    ] = None,
    json: options.Json = False,
) -> None:
    """Compare trials by experiment and parameters: successes, durations, and causes of what failed."""
    from dataclasses import asdict

    from swarmctl.capsule.comparison import compare as compared
    from swarmctl.views import capsule as view

    if plot is not None:
        extras.need("--plot", "experiments", "matplotlib", "rosbags")
        if plot.suffix not in (".svg", ".png"):
            console.fail(
                f"--plot {plot}: no name of a drawing", "end it with .svg or .png", code=exit_codes.USAGE
            )
    indexes, errors = _found(folders)
    rows = compared(indexes.values())
    if json:
        experiments = [asdict(one) | {"interval": one.interval()} for one in rows]
        console.print_json({"v": 1, "experiments": experiments, "errors": _texts(errors)})
    elif rows:
        console.out().print(view.comparison(rows))
    troubles: list[str] = []
    if plot is not None and indexes:
        from swarmctl.views import trajectory_plot

        robots = _robots(indexes, troubles)
        if robots:
            file_writes.replace(plot, trajectory_plot.plot(robots, plot.suffix[1:]))
        else:
            troubles.append("nothing to draw: no bag has a topic of odometry")
    _end(errors, troubles)


def _robots(indexes: Mapping[Path, Index], troubles: list[str]) -> dict[str, list[Sequence[Sample]]]:
    """The trajectories of all trials by topic of odometry, in s since their beginning."""
    from swarmctl.capsule.bag_topics import read

    found: dict[str, list[Sequence[Sample]]] = {}
    for folder, index in indexes.items():
        bags = read(folder / "bags")
        troubles += bags.troubles
        for name, topic in bags.topics.items():
            if topic.odometry and topic.samples:
                began = index.start(topic.recorder)
                moved = [one._replace(t=one.t - began) for one in topic.trajectory()]
                found.setdefault(name, []).append(moved)
    return dict(sorted(found.items()))


@capsule.command(epilog=exit_codes.epilog())
def export(
    folders: _Folders,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="The folder to write to.")],
) -> None:
    """Write trials.csv, a row per trial, and samples.csv, a row per pose in the bags."""
    extras.need("export", "experiments", "pandas", "rosbags")
    from swarmctl.capsule import frames

    indexes, errors = _found(folders)
    troubles: list[str] = []
    tables = {"trials": frames.trials(indexes), "samples": frames.samples(indexes, troubles.append)}
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        console.fail(console.cannot_write(error, out), "choose another --out")
    for name, table in tables.items():
        file_writes.replace(out / f"{name}.csv", table.to_csv(index=False).encode(errors="backslashreplace"))
    _end(errors, troubles)


def _end(errors: Mapping[Path, CapsuleError], troubles: Iterable[str] = ()) -> NoReturn:
    """Names capsules and bags that cannot be read."""
    for error in errors.values():
        console.show(f"error: {error}\n  help: {error.help}", error=True)
    for trouble in troubles:
        console.show(f"error: {trouble}", error=True)
    raise typer.Exit(exit_codes.ERROR if errors or troubles else exit_codes.OK)


def _texts(errors: Mapping[Path, CapsuleError]) -> dict[str, str]:
    return {str(folder): str(error) for folder, error in errors.items()}


def _found(folders: Iterable[Path]) -> tuple[dict[Path, Index], dict[Path, CapsuleError]]:
    """The index of each capsule, each once, and why others cannot be read."""
    from swarmctl.capsule.capsule_index import CapsuleError, Index
    from swarmctl.capsule.folder import below

    found = {one: _read(one) for folder in folders for one in below(folder) or [folder]}
    return (
        {folder: one for folder, one in found.items() if isinstance(one, Index)},
        {folder: one for folder, one in found.items() if isinstance(one, CapsuleError)},
    )


def _read(folder: Path) -> Index | CapsuleError:
    from swarmctl.capsule.capsule_index import CapsuleError
    from swarmctl.capsule.folder import read

    try:
        return read(folder)
    except CapsuleError as error:
        return error
