"""``swarmctl driver``: the robot types that there are, and one of them in full."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import access, console, exits

if TYPE_CHECKING:
    from swarmctl.views.robot_types import Shown

driver = typer.Typer(
    name="driver", no_args_is_help=True, help="Show robot types, write one of your own, try it on a robot."
)

Folder = Annotated[
    Path,
    typer.Option("--dir", metavar="DIR", help="The folder of the spec; types of your own are in DIR/robots."),
]


@driver.command(name="list", epilog=exits.told())
def list_(folder: Folder = Path(), json: access.Json = False) -> None:
    """List the robot types: those that swarmctl ships, and those beside a spec."""
    from swarmctl.views import robot_types as view

    types, wrong = known_types(folder)
    if json:
        console.print_json({"v": 1, "types": [view.listed(one) for one in types.values()]})
    else:
        console.out().print(view.table(types.values()))
    if wrong:
        raise typer.Exit(exits.ERROR)


@driver.command(epilog=exits.told())
def show(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot type: see `driver list`.")],
    folder: Folder = Path(),
    json: access.Json = False,
) -> None:
    """Show everything about a robot type: its line, its limits, its requests, topics and dead-man."""
    from swarmctl.views import robot_types as view

    shown = the_type(name, folder)
    if json:
        console.print_json({"v": 1, **view.detailed(shown)})
    else:
        console.out().print(view.page(shown), end="")


def known_types(folder: Path) -> tuple[dict[str, Shown], bool]:
    """Every type by name, and whether files beside the spec are wrong; what is wrong is shown."""
    from swarmctl.spec.catalog import load_catalog
    from swarmctl.views.robot_types import SHIPPED, Shown

    catalog = load_catalog(folder / "robots")
    console.print_diagnostics(catalog.diagnostics)
    own = {file.stem: str(file) for file in (folder / "robots").glob("*.yaml")}
    types = {name: Shown(name, own.get(name, SHIPPED), one) for name, one in sorted(catalog.types.items())}
    return types, bool(catalog.diagnostics)


def the_type(name: str, folder: Path) -> Shown:
    """The type called ``name``; without one that can be read the program ends."""
    from swarmctl.spec.suggest import did_you_mean

    types, _ = known_types(folder)
    if name not in types:
        if (folder / "robots" / f"{name}.yaml").exists():  # and what is wrong with it stands above
            raise typer.Exit(exits.ERROR)
        console.fail(
            f"there is no robot type `{name}`",
            *did_you_mean(name, types, "there are"),
            f"types of your own are in {folder / 'robots'}; `swarmctl driver new {name}` writes one",
            code=exits.USAGE,
        )
    return types[name]
