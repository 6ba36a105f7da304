"""What ``deploy`` shows and asks before it changes anything."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from swarmctl.cli import console, exit_codes, next_command

if TYPE_CHECKING:
    from rich.text import Text

    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.plan.plan import Plan
    from swarmctl.plan.waves import Order
    from swarmctl.swarm.resolved import Swarm


def sizes(serial: str) -> list[str]:
    """Returns the sizes of waves in ``--serial``; exits with an error if one is none."""
    from swarmctl.plan.waves import valid_size

    found = [one.strip() for one in serial.split(",")] if serial else []
    if wrong := next((one for one in found if not valid_size(one)), None):
        console.fail(
            f"--serial: `{wrong}` is no size of a wave", "write hosts or percent, such as 1,25%,100%"
        )
    return found


@dataclass(frozen=True)
class View:
    """How the plan of a deploy is shown. ``where``: the options that choose hosts."""

    spec: SpecFiles
    swarm: Swarm
    where: Sequence[str]
    details: bool
    json: bool

    def dry_run(self, plan: Plan, order: Order) -> int:
        """Prints the plan and the order. Returns the exit code, as that of ``plan``."""
        if self.json:
            console.print_json(plan.to_json() | {"order": order.to_json()})
        else:
            self._show(plan, order, console.out().print)
        optional = {host.name for host in self.swarm.hosts.values() if host.optional}
        return exit_codes.of_plan(plan, optional, detailed=False)

    def ask(self, plan: Plan, order: Order) -> None:
        """On a terminal, shows the plan and asks; exits if the answer is not yes. Scripts see no question."""
        if not (sys.stdin.isatty() and console.err().is_terminal):
            return
        self._show(plan, order, console.err().print)
        if str(typer.prompt("Deploy this? (yes)", default="no", err=True)) != "yes":
            console.fail("nothing was changed", "answer `yes`, or use --yes in scripts")

    def _show(self, plan: Plan, order: Order, show: Callable[[Text], None]) -> None:
        from swarmctl.views.equal_hosts import names_of
        from swarmctl.views.plan import PlanView
        from swarmctl.views.waves import order_text

        complete = next_command.completing(self.spec, self.where)
        show(PlanView(names_of(self.swarm), False, self.details, console.columns(), complete).text(plan))
        if order.waves:
            show(order_text(order, console.columns()))
