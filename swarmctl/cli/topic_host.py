"""The host on which a tool for a topic runs, what it may do there, and its lines as they come."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import closing
from typing import NoReturn

import typer

from swarmctl import streams
from swarmctl.cli import console, exit_codes, ros_tools
from swarmctl.cli.where import Where
from swarmctl.remote import host_commands
from swarmctl.remote.host_commands import MARK, Ran
from swarmctl.remote.parallel_hosts import Event, Finished, Note
from swarmctl.remote.transport import HostError, Kind
from swarmctl.render.middleware import Middleware, middleware_of
from swarmctl.render.topic_tool import END_OF_MESSAGE
from swarmctl.suggest import did_you_mean
from swarmctl.swarm import topic_island
from swarmctl.swarm.resolved import Island, Swarm
from swarmctl.views.escape import printable


class TopicHost:
    """A topic, and the host on which its tool runs; exits with an error if that is not known."""

    def __init__(self, where: Where, topic: str, island: str, host: str) -> None:
        self._where, self.topic = where, topic_island.full_name(topic)
        self._swarm = console.read_spec(where.spec)
        there = _island(self._swarm, self.topic, island, host)
        self.middleware = middleware_of(there.distro)
        if host and host not in there.hosts:
            _no("--host", host, f"island {there.name} has", there.hosts)
        self._host = host or there.hub

    def say_who_commands(self) -> None:
        """Prints whether the host may command the robot behind the topic; exits if its gate is passed by."""
        if (robot := topic_island.behind_gate(self._swarm, self.topic)) and robot.command:
            console.fail(
                f"only the gate of {robot.name} publishes on {self.topic}",
                f"commands for {robot.name} go to {robot.command.topic}",
            )
        if (robot := topic_island.commanded_by(self._swarm, self.topic)) is None:
            return
        hosts_are_known = "node-hosts" in self.middleware.capabilities
        address = self._swarm.hosts[self._host].advertised if hosts_are_known else ""
        if not topic_island.is_guarded(robot):
            text = f"warning: {robot.name} obeys whoever publishes here: nothing checks who commands it"
        elif by := topic_island.commander_at(robot, address):
            text = f"note: {robot.name} obeys its commander {by.name}, and so this tool on {self._host}"
        else:
            commanders = ", ".join(one.name for one in robot.commanders) or "nobody"
            text = (
                f"warning: {robot.name} will ignore this: by `control` it obeys {commanders}, "
                f"and not this tool on {self._host}"
            )
        console.show(text, error=True)

    def exit(self, words: Sequence[str], *, messages: int | None = None) -> NoReturn:
        """Runs the tool, prints its lines as they come, and exits with its exit code."""
        from swarmctl.cli.ssh_targets import transport

        target = self._where.targets(self._swarm)[self._host]
        line = self.middleware.topic_tool.line(self._swarm.name, words)
        events = host_commands.run([target], line, transport(become=False), parallel=1, follow=True)
        with console.until_ctrl_c(), closing(events):
            ended = _printed(events, messages)
        if ended is None:
            raise typer.Exit(exit_codes.OK)
        if error := lack_of(ended, self._swarm.name, self.middleware):
            code = exit_codes.HOSTS_FAILED if error.reached else exit_codes.HOSTS_UNREACHABLE
            console.fail(
                error.message, *([self._where.complete(error.hint)] if error.hint else []), code=code
            )
        raise typer.Exit(ended.status or exit_codes.OK)


def error_of(ended: Ran, swarm: str, middleware: Middleware) -> HostError | None:
    """Returns why a tool that should have ended well has not; None if it has."""
    if (error := lack_of(ended, swarm, middleware)) or not ended.status:
        return error
    last = ended.stderr.decode("utf-8", "replace").strip().rpartition("\n")[2]
    return HostError(Kind.FAILED, f"{ended.host}: exit code {ended.status}: {last}")


def lack_of(ended: Ran, swarm: str, middleware: Middleware) -> HostError | None:
    """Returns why the tool did not run at all, or not to its end."""
    package = middleware.topic_tool.package
    return ros_tools.lack(ended.host, ended.status, swarm, package, package, middleware) or ended.error


def _printed(events: Iterable[Event[Ran]], messages: int | None) -> Ran | None:
    """Prints the lines of a tool; returns how it ended.

    None if it goes on: after so many ``messages``, or because nobody reads them.
    """
    for event in events:
        if isinstance(event, Finished):
            return host_commands.ran(event)
        if not isinstance(event, Note):
            continue
        if event.text.startswith(MARK):
            console.err().print(printable(event.text.removeprefix(MARK)))
            continue
        print(printable(event.text), flush=True)
        if messages is not None and event.text == END_OF_MESSAGE:
            messages -= 1
        if messages == 0 or streams.has_failed():
            break
    return None


def _island(swarm: Swarm, topic: str, name: str, host: str) -> Island:
    """The island that is named, else that of ``host``, else the topic's; exits for none."""
    islands = {one.name: one for one in swarm.islands}
    if name:
        return islands[name] if name in islands else _no("--island", name, "the islands are", islands)
    if host:
        of_host = {each: one for one in swarm.islands for each in one.hosts}
        return of_host[host] if host in of_host else _no("--host", host, "the hosts are", of_host)
    found = topic_island.island_of_topic(swarm, topic)
    if found is None:
        console.fail(
            f"{topic} is in no robot's namespace, and may be on any island",
            f"name one by --island: {', '.join(islands)}",
            code=exit_codes.USAGE,
        )
    return found


def _no(option: str, name: str, are: str, known: Iterable[str]) -> NoReturn:
    console.fail(f"{option}: there is no `{name}`", *did_you_mean(name, known, are), code=exit_codes.USAGE)
