"""``swarmctl driver list`` and ``show``: lists robot types and shows one in detail."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from swarmctl.cli import complete, console, exit_codes, options

if TYPE_CHECKING:
    from swarmctl.views.robot_types import Shown

Folder = Annotated[
    Path,
    typer.Option("--dir", metavar="DIR", help="The folder of the spec; your own types are in DIR/robots."),
]


def list_(folder: Folder = Path(), json: options.Json = False) -> None:
    """List the robot types that swarmctl ships and those in DIR/robots."""
    from swarmctl.views import robot_types as view

    types, wrong = known_types(folder)
    if json:
        console.print_json({"v": 1, "types": [view.listed(one) for one in types.values()]})
    else:
        console.out().print(view.table(types.values()))
    if wrong:
        raise typer.Exit(exit_codes.ERROR)


def show(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME", help="The robot type (see `driver list`).", autocompletion=complete.types
        ),
    ],
    folder: Folder = Path(),
    json: options.Json = False,
) -> None:
    """Show a robot type: serial line, limits, requests, topics and dead-man timeouts."""
    from swarmctl.views import robot_types as view

    shown = the_type(name, folder)
    if json:
        console.print_json({"v": 1, **view.detailed(shown)})
    else:
        page = view.page(shown)
        page.rstrip()
        console.show(page)


def known_types(folder: Path) -> tuple[dict[str, Shown], bool]:
    """All types by name, and True if files beside the spec have errors, which are printed."""
    from swarmctl.diagnostics import has_errors
    from swarmctl.spec.catalog import load_catalog
    from swarmctl.views.robot_types import SHIPPED, Shown

    catalog = load_catalog(folder / "robots")
    console.print_diagnostics(catalog.diagnostics)
    sources = {name: source.path for name, source in catalog.sources.items()}
    types = {
        name: Shown(name, sources.get(name, SHIPPED), one) for name, one in sorted(catalog.types.items())
    }
    return types, has_errors(catalog.diagnostics)


def the_type(name: str, folder: Path) -> Shown:
    """The type called ``name``; exits with an error if there is none or it has errors."""
    from swarmctl.suggest import did_you_mean

    types, _ = known_types(folder)
    if name not in types:
        if (folder / "robots" / f"{name}.yaml").exists():  # and what is wrong with it stands above
            raise typer.Exit(exit_codes.ERROR)
        console.fail(
            f"there is no robot type `{name}`",
            *did_you_mean(name, types, "there are"),
            f"your own types are in {folder / 'robots'}; `swarmctl driver new {name}` writes one",
            code=exit_codes.USAGE,
        )
    return types[name]
