"""What a deploy may do, and what came of each host: rules, outcomes, hosts that are held back. Values."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

from swarm_onboard.agent.systemd import UnitState

from swarmctl.deploy.host_transaction import Terms
from swarmctl.deploy.prepare import Prepared
from swarmctl.plan.observed_host import Observed, not_edited, not_newer
from swarmctl.plan.plan import HostPlan, Problem
from swarmctl.plan.waves import Order
from swarmctl.remote.parallel_hosts import Finished
from swarmctl.remote.transport import HostError
from swarmctl.remote.transport import Kind as ErrorKind
from swarmctl.render.bundle import Bundle
from swarmctl.yamltext import hostlist

#: Kinds of errors of hosts that may get the release later by themselves.
WAITS = (ErrorKind.UNREACHABLE, ErrorKind.LOST, ErrorKind.BUSY)


@dataclass(frozen=True)
class Rules:
    """``most_failed``: hosts that may fail before the others are held back, None for any number;
    ``optional``: hosts that do not count; ``terms``: what a change must show before it stays;
    ``stop_robots``: robots that move or are under command are stopped, where a change would touch them;
    ``overwrite_edits``: what people have edited on a host may be replaced;
    ``wait``: s that the survey waits for robots that must not be touched now; ``apart``: kinds of errors that
    hold back no others, where hosts need not change together; ``when_seen``: a host keeps a release that was
    chosen later, and robots of hosts that do not answer hold nothing back; ``issued``: when it was chosen, s
    since 1970; ``failed``: hosts on which the release has failed, and is not tried again."""

    most_failed: int | None = 0
    optional: Collection[str] = ()
    terms: Terms = field(default_factory=Terms)
    stop_robots: bool = False
    wait: float = 0.0
    overwrite_edits: bool = False
    apart: Collection[ErrorKind] = ()
    when_seen: bool = False
    issued: float = field(default_factory=time.time)
    failed: Collection[str] = ()

    def holds(self, errors: Mapping[str, HostError]) -> bool:
        """Returns True if so many hosts have failed that the others are held back."""
        return self.most_failed is not None and len(self.counted(errors)) > self.most_failed

    def counted(self, errors: Mapping[str, HostError]) -> dict[str, HostError]:
        """Returns the errors of the hosts that count."""
        return {
            host: error
            for host, error in errors.items()
            if host not in self.optional and error.kind not in self.apart
        }

    def allowed(self, plan: HostPlan, bundle: Bundle, observed: Observed) -> HostPlan:
        """Returns the plan, with a problem if the host keeps what it has by these rules."""
        if not plan.problem and self.when_seen:
            plan = not_newer(plan, observed, self.issued)
        if not plan.problem and plan.steps and plan.host in self.failed:
            plan = replace(plan, problem=Problem("failed", f"release {plan.next} has failed here before"))
        if not plan.problem and not self.overwrite_edits:
            plan = not_edited(plan, bundle, observed)
        return plan

    def of(self, order: Order) -> Rules:
        """Returns the rules for this order."""
        return replace(self, apart=()) if order.together else self


@dataclass(frozen=True)
class Outcome:
    """The result of one host: the executed plan, and the units after it.

    ``recovered``: whether an earlier deploy, which was interrupted, was confirmed or undone first.
    """

    plan: HostPlan
    units: Mapping[str, UnitState] = field(default_factory=dict)
    recovered: bool = False

    @property
    def changed(self) -> bool:
        """True if the plan had steps on the host, or an earlier deploy was recovered."""
        return bool(self.plan.steps) or self.recovered

    @property
    def errors(self) -> list[str]:
        """What units that run report if they cannot do their task, such as a driver without its device."""
        return [
            f"{unit} runs with an error: {state.text}" for unit, state in self.units.items() if state.error
        ]


@dataclass(frozen=True)
class Removed:
    """The result of a removal: ``changed`` if the swarm was deployed there."""

    changed: bool


Result = Outcome | Removed | Prepared | HostError


def held(waves: Sequence[Sequence[str]], because: str) -> Iterator[Finished[Outcome]]:
    """Yields the result of each host of these waves, which is left as it is."""
    error = HostError(ErrorKind.HELD, because)
    return (Finished(host, error, 0.0) for wave in waves for host in wave)


def why(failed: Mapping[str, HostError]) -> str:
    """Returns why hosts are held back: the failed ones, those of the same kind together."""
    kinds: dict[str, list[str]] = {}
    for host, error in failed.items():
        words = {ErrorKind.UNFIT: "cannot run its part", ErrorKind.UNREACHABLE: "does not answer"}
        words[ErrorKind.BUSY] = "has a robot that must not be touched now"
        words[ErrorKind.NEWER] = "has a release that was deployed later"
        words[ErrorKind.LOST] = "was lost amid the work"
        words[ErrorKind.EDITED] = "has files that were edited there"
        text = words.get(error.kind, "failed")
        if error.kind is ErrorKind.REFUSED:
            text = f"is {error}" if _locked(error) else f"refused it: {error}"
        kinds.setdefault(text, []).append(host)
    return "; ".join(f"{hostlist.written(sorted(hosts))} {text}" for text, hosts in kinds.items())


def locked_ones(failed: Mapping[str, HostError]) -> dict[str, HostError]:
    """Returns the errors of the hosts that another operator changes, or whose change waits there."""
    return {host: error for host, error in failed.items() if _locked(error)}


def _locked(error: HostError) -> bool:
    return error.kind is ErrorKind.REFUSED and str(error).startswith("locked by ")
