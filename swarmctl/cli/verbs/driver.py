"""``swarmctl driver``: its verbs, which are in the modules ``driver_*``."""

from __future__ import annotations

import typer

from swarmctl.cli import exit_codes
from swarmctl.cli.verbs.driver_new import new
from swarmctl.cli.verbs.driver_test import driver_test
from swarmctl.cli.verbs.driver_types import list_, show

driver = typer.Typer(
    name="driver", no_args_is_help=True, help="Show robot types, write your own, test a robot with it."
)
for name, verb in (("list", list_), ("show", show), ("new", new), ("test", driver_test)):
    driver.command(name, epilog=exit_codes.epilog())(verb)
