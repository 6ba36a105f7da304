"""A whole deploy, as the verb makes it, as one stream of events."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import pytest

from swarmctl.analysis.impact import Impact
from swarmctl.deploy.deployment import Deployment
from swarmctl.deploy.host_transaction import HostTransaction, Terms
from swarmctl.deploy.outcome import Outcome, Rules
from swarmctl.plan.waves import Consistency, order
from swarmctl.remote.parallel_hosts import Event
from swarmctl.remote.transport import Kind, Target, Transport
from swarmctl.render.bundle import Bundle
from tests.onboard.agent.fakehost import FakeHost


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
    apart: tuple[Kind, ...] = (),
    issued: float | None = None,
    parallel: int = 16,
    **more: Any,
) -> Iterator[Event[Outcome]]:
    """Deploys to all hosts at a time, whatever becomes of some. ``issued``: as for `--when-seen`."""
    rules = Rules(
        most_failed,
        optional,
        terms or Terms(healthy_for=0.1, healthy_within=5),
        overwrite_edits=overwrite_edits,
        apart=apart,
        when_seen=issued is not None,
        **({} if issued is None else {"issued": issued}),
    )
    with Deployment(bundles, targets, transport, rules=rules, parallel=parallel, **more) as deployment:
        for _ in deployment.survey():
            pass
        yield from deployment.change(order(deployment.due, parts, serial, consistency))


def after_the_change(patch: pytest.MonkeyPatch, happen: Callable[[], None]) -> None:
    """Has something happen on a host between its change and the look at its units."""
    hold = HostTransaction._hold

    def first(self: HostTransaction, *arguments: Any) -> Any:
        happen()
        return hold(self, *arguments)

    patch.setattr(HostTransaction, "_hold", first)


def fails(host: FakeHost, unit: str) -> None:
    """Has a running unit of a host end with an error."""
    (host.prefix / "units" / unit).unlink()
    (host.prefix / f"failed-{unit}").touch()
