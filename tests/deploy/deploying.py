"""A whole deploy, as the verb makes it, as one stream of events."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from swarmctl.analysis.impact import Impact
from swarmctl.deploy.deployment import Deployment, Rules
from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.outcome import Outcome
from swarmctl.plan.waves import Consistency, order
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Target, Transport
from swarmctl.render.bundle import Bundle


def deploy(
    bundles: Mapping[str, Bundle],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    most_failed: int | None = None,
    optional: tuple[str, ...] = (),
    terms: Terms | None = None,
    serial: tuple[str, ...] = ("100%",),
    consistency: Consistency = "independent",
    parts: tuple[Impact, ...] = (),
    overwrite_edits: bool = False,
    **more: Any,
) -> Iterator[Event[Outcome]]:
    """Deploys to all hosts at a time, whatever becomes of some."""
    rules = Rules(
        most_failed,
        optional,
        terms or Terms(healthy_for=0.1, healthy_within=5),
        overwrite_edits=overwrite_edits,
    )
    with Deployment(bundles, targets, transport, rules=rules, **more) as deployment:
        for _ in deployment.survey():
            pass
        yield from deployment.change(order(deployment.due, parts, serial, consistency))
