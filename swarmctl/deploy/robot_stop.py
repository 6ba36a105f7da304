"""Stops, releases and restarts robots by the agents on their hosts: one connection a host, no look before."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from swarm_onboard.agent.robot_motion import RobotMotion
from swarm_onboard.agent.verbs import restart as restart_verb
from swarm_onboard.agent.verbs import start as start_verb
from swarm_onboard.agent.verbs import stop as stop_verb

from swarmctl.remote import agent_archive, agent_client, operators, parallel_hosts
from swarmctl.remote.ask import ask, ask_each
from swarmctl.remote.transport import HostError, Kind, Session, Target, Transport

PATIENCE = 2.0  # s for the wheels to be confirmed to stand; a host does not take longer to answer
_TIMEOUT = 15.0  # s
_PROVEN = ("wheels", "odometry")

State = Literal["stands", "unproven", "failed"]
#: Errors before a host had the request. After any other it may have stopped its robots.
_BEFORE_REQUEST = (Kind.UNREACHABLE, Kind.HOST_KEY, Kind.AUTH, Kind.PRIVILEGE, Kind.STOPPED, Kind.REFUSED)


@dataclass(frozen=True)
class RobotStop:
    """The result for one robot.

    ``seconds``: until it stood, from the moment of the run that ``since`` of ``stop`` counts from; 0 if it
    stood before; None if not known.
    """

    robot: str
    host: str
    state: State
    proof: str = "none"
    seconds: float | None = None
    commander: str = ""
    trouble: str = ""
    kind: Kind | None = None  # of the error of its host

    @property
    def may_have_stopped(self) -> bool:
        """False if it is certain that nothing stopped it."""
        return self.kind not in _BEFORE_REQUEST


@dataclass(frozen=True)
class HostStop:
    """The answer of a host, and when it came, in s since the run began."""

    answer: stop_verb.Answer
    arrived: float


def stop(
    swarm: str,
    robots: Mapping[str, Sequence[str]],
    targets: Mapping[str, Target],
    transport: Transport,
    since: Callable[[], float],
    *,
    others: bool,
    parallel: int,
) -> Iterator[parallel_hosts.Event[HostStop]]:
    """Stops ``robots``, by host; with ``others`` all that run on these hosts.

    ``since`` returns the s since the command was given.
    """
    who = operators.this_one()

    def work(session: Session, target: Target, _: Callable[[str], None]) -> HostStop:
        request = stop_verb.Request(swarm, who, list(robots[target.host]), others, PATIENCE)
        with agent_client.agent_session(session) as host:
            return HostStop(ask(host, stop_verb.handle, request, timeout=_TIMEOUT), since())

    return _on_all(robots, targets, work, transport, parallel)


def start(
    swarm: str,
    robots: Mapping[str, Sequence[str]],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    others: bool,
    parallel: int,
) -> Iterator[parallel_hosts.Event[start_verb.Answer]]:
    """Releases ``robots``, by host; with ``others`` all that are stopped on these hosts."""

    requests = {host: start_verb.Request(swarm, list(chosen), others) for host, chosen in robots.items()}
    return ask_each(start_verb.handle, requests, targets, transport, parallel=parallel, timeout=_TIMEOUT)


def restart(
    swarm: str,
    robots: Mapping[str, Sequence[str]],
    targets: Mapping[str, Target],
    transport: Transport,
    *,
    others: bool,
    stop_robots: bool,
    parallel: int,
) -> Iterator[parallel_hosts.Event[restart_verb.Answer]]:
    """Restarts the units of ``robots``, by host; with ``others`` those of all robots on these hosts.

    A host refuses for a robot that moves or is under command; with ``stop_robots`` it stops it first.
    """

    requests = {
        host: restart_verb.Request(
            swarm, list(chosen), others, who=operators.this_one(), stop_robots=stop_robots
        )
        for host, chosen in robots.items()
    }
    return ask_each(
        restart_verb.handle, requests, targets, transport,
        parallel=parallel, timeout=agent_client.CHANGE_TIMEOUT,
    )  # fmt: skip


def robot_stops(host: str, robots: Sequence[str], result: HostStop | HostError) -> list[RobotStop]:
    """Returns the result of each robot of a host, those that the host knows beside ``robots`` included."""
    if isinstance(result, HostError):
        hint = f" ({result.hint})" if result.hint else ""
        return [
            RobotStop(one, host, "failed", trouble=result.message + hint, kind=result.kind) for one in robots
        ]
    if not result.answer.deployed:
        trouble = "the swarm is not deployed to this host"
        return [RobotStop(one, host, "failed", trouble=trouble, kind=Kind.REFUSED) for one in robots]
    before = result.arrived - result.answer.elapsed
    return [_robot_stop(name, host, one, before) for name, one in result.answer.robots.items()]


def _robot_stop(name: str, host: str, one: RobotMotion, before: float) -> RobotStop:
    if not one.latched:
        return RobotStop(name, host, "failed", trouble=one.trouble, kind=Kind.REFUSED)
    seconds = one.seconds
    return RobotStop(
        name,
        host,
        "stands" if one.proof in _PROVEN else "unproven",
        one.proof,
        seconds if not seconds else round(before + seconds, 2),
        one.commander,
        "" if one.proof in _PROVEN else one.trouble,
    )


def _on_all(
    robots: Mapping[str, Sequence[str]],
    targets: Mapping[str, Target],
    work: parallel_hosts.Work[parallel_hosts.R],
    transport: Transport,
    parallel: int,
) -> Iterator[parallel_hosts.Event[parallel_hosts.R]]:
    # The archive of the agent is made while the connections are.
    threading.Thread(target=agent_archive.agent, daemon=True).start()
    return parallel_hosts.run((targets[one] for one in robots), work, transport=transport, parallel=parallel)
