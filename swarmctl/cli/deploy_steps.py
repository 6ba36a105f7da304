"""The rounds of ``deploy`` and ``rollback`` on a terminal: survey, plan and question, change."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import typer

from swarmctl.cli import console, exit_codes, rollout_output, saved_plan

if TYPE_CHECKING:
    from rich.text import Text

    from swarmctl.cli.saved_plan import SavedPlan
    from swarmctl.cli.where import Where
    from swarmctl.deploy.deployment import Deployment
    from swarmctl.deploy.outcome import Result
    from swarmctl.plan.plan import Plan
    from swarmctl.plan.waves import Order
    from swarmctl.remote.parallel_hosts import Stop
    from swarmctl.spec.load import Document
    from swarmctl.swarm.resolved import Swarm


MOST = 3


def with_single_points(made: Plan, document: Document) -> Plan:
    """The plan with the worst single points of failure of its swarm."""
    from swarmctl.analysis.impact import impacts, single_points
    from swarmctl.swarm.index import SwarmIndex

    return replace(made, single_points=single_points(impacts(SwarmIndex(document)))[:MOST])


def sizes(serial: str) -> list[str]:
    """Returns the sizes of waves in ``--serial``; exits with an error if one is none."""
    from swarmctl.plan.waves import valid_size

    found = [one.strip() for one in serial.split(",")] if serial else []
    if wrong := next((one for one in found if not valid_size(one)), None):
        console.fail(
            f"--serial: `{wrong}` is not a size of a wave", "write hosts or percent, such as 1,25%,100%"
        )
    return found


def asks() -> bool:
    """Returns True on a terminal: scripts see no question."""
    return sys.stdin.isatty() and console.err().is_terminal


def agree(question: str) -> None:
    """Asks; exits if the answer is not yes."""
    if str(typer.prompt(f"{question} (yes)", default="no", err=True)) != "yes":
        console.fail("nothing was changed", "answer `yes`, or use --yes in scripts")


@dataclass(frozen=True)
class View:
    """How the plan of a deploy is shown."""

    verb: str
    swarm: Swarm
    where: Where
    details: bool
    json: bool

    def executed(
        self,
        deployment: Deployment,
        stop: Stop,
        choose: Callable[[Deployment], Order],
        *,
        dry_run: bool,
        yes: bool,
        saved: SavedPlan | None = None,
    ) -> Mapping[str, Result]:
        """Surveys the hosts, asks, and changes them. Returns the results; exits after a dry run."""
        from swarmctl.remote.parallel_hosts import interruptible

        hosts = deployment.hosts
        with deployment:
            with interruptible(rollout_output.note, stop):
                rollout_output.follow(deployment.survey(), hosts, quiet=self.json)
            if saved and (reason := saved_plan.stale(saved, deployment.plan)):
                console.fail(
                    f"nothing was changed, the plan is stale: {reason}", "make it again, and look at it"
                )
            chosen = choose(deployment)
            if dry_run:
                raise typer.Exit(self._dry_run(deployment.plan, chosen))
            if chosen.waves and not (stop.requested or deployment.held(chosen) or yes or saved or self.json):
                self._ask(deployment.plan, chosen)
            with interruptible(rollout_output.note, stop):
                return rollout_output.results(deployment.change(chosen), hosts, quiet=self.json)

    def _dry_run(self, plan: Plan, order: Order) -> int:
        """Prints the plan and the order. Returns the exit code, as that of ``plan``."""
        if self.json:
            console.print_json(plan.to_json() | {"order": order.to_json()})
        else:
            self._show(plan, order, console.out().print)
        optional = {host.name for host in self.swarm.hosts.values() if host.optional}
        return exit_codes.of_plan(plan, optional, detailed=False)

    def _ask(self, plan: Plan, order: Order) -> None:
        """On a terminal, shows the plan and asks; exits if the answer is not yes. Scripts see no question."""
        if asks():
            self._show(plan, order, console.err().print)
            agree(f"{self.verb.capitalize()} now?")

    def _show(self, plan: Plan, order: Order, show: Callable[[Text], None]) -> None:
        from swarmctl.views.equal_hosts import names_of
        from swarmctl.views.plan import PlanView, order_text

        names, complete = names_of(self.swarm), self.where.complete
        show(PlanView(names, False, self.details, console.columns(), complete).text(plan))
        if order.waves:
            show(order_text(order, console.columns()))
