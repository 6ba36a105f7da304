"""Starts, watches and ends recordings on hosts, fetches their bags, and prints what happens."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import typer

from swarmctl.cli import console, exit_codes, ros_tools
from swarmctl.remote import host_recordings
from swarmctl.remote.host_recordings import Fetched
from swarmctl.remote.parallel_hosts import Event, Finished, Note
from swarmctl.remote.transport import HostError, Kind, Target, Transport
from swarmctl.render.middleware import middleware_at
from swarmctl.swarm.resolved import Swarm
from swarmctl.views import recordings as view
from swarmctl.views.escape import printable

if TYPE_CHECKING:
    from swarm_onboard.agent.bags import Recording
    from swarm_onboard.agent.verbs.record import Request

R = TypeVar("R")


class RecordingHosts:
    """The hosts of one run of ``swarmctl record``. ``complete`` completes the commands in a hint."""

    def __init__(
        self,
        swarm: Swarm,
        targets: Sequence[Target],
        transport: Transport,
        complete: Callable[[str], str],
        parallel: int,
        *,
        json: bool,
    ) -> None:
        self._json = json
        self._swarm, self._targets, self._transport = swarm, targets, transport
        self._complete, self._parallel = complete, parallel
        self._errors: dict[str, HostError] = {}
        self._fetched: list[Fetched] = []

    def exit_code(self) -> int:
        """Returns that of the errors of hosts."""
        if any(error.reached for error in self._errors.values()):
            return exit_codes.HOSTS_FAILED
        return exit_codes.HOSTS_UNREACHABLE if self._errors else exit_codes.OK

    @property
    def have_bags(self) -> bool:
        """True if bags were fetched."""
        return any(one.bags for one in self._fetched)

    def document(self) -> dict[str, Any]:
        """Returns what ``--json`` prints."""
        fetched = {one.host: one for one in self._fetched}
        return {"v": 1, "swarm": self._swarm.name, "hosts": [
            self._entry(host, fetched.get(host, Fetched(host))) for host in {**fetched, **self._errors}
        ]}  # fmt: skip

    def _entry(self, host: str, one: Fetched) -> dict[str, Any]:
        recording, error = one.recording, self._errors.get(host)
        return {
            "host": host,
            "topics": recording.topics if recording else [],
            "ended": recording.ended if recording else "",
            "bags": [str(place) for place in one.bags],
            "error": error and error.to_json(),
        }

    def start(self, requests: Mapping[str, Request]) -> Mapping[str, Sequence[str]]:
        """Starts the recordings; returns the topics that are recorded by host."""
        found: dict[str, list[str]] = {}
        targets = [one for one in self._targets if one.host in requests]
        modules = {one.host: middleware_at(self._swarm, one.host).bag_recorder.graph for one in targets}
        starting = host_recordings.start(requests, targets, modules, self._transport, parallel=self._parallel)
        for host, result in self._results(starting, "starting"):
            if error := result if isinstance(result, HostError) else self._failure(host, result):
                self._fail(host, error)
            elif not isinstance(result, HostError) and result.topics:
                found[host] = result.topics
                console.show(f"{host}  records {len(found[host])} topics", error=True)
        self._targets = [one for one in targets if one.host in found]
        return found

    def watch(self) -> None:
        """Returns after Ctrl-C, or once all recordings have ended."""
        if not console.err().is_terminal:
            console.show("Ctrl-C ends the recording", error=True)
        try:
            for host, result in self._results(
                host_recordings.watch(self._swarm.name, self._targets, self._transport),
                "recorded; Ctrl-C ends it",
            ):
                if isinstance(result, HostError):
                    self._fail(host, result)
        except KeyboardInterrupt:
            pass

    def fetch(self, folder: Path, again: str) -> None:
        """Ends the recordings, and moves the bags to ``folder``; ``again``: the command for what is left."""
        fetching = host_recordings.fetch(
            self._swarm.name, self._targets, self._transport, folder, parallel=self._parallel
        )
        try:
            for host, result in self._results(fetching, "fetched"):
                if isinstance(result, HostError):
                    self._fail(host, result)
                    continue
                self._fetched.append(result)
                for line in view.lines(result):
                    console.show(line, error=self._json)
                if result.recording and (error := self._failure(host, result.recording)):
                    self._fail(host, error)
        except KeyboardInterrupt:
            console.show(f"interrupted; `{again}` fetches the rest", error=True)
            raise typer.Exit(exit_codes.INTERRUPTED) from None
        if self._errors:
            console.show(f"`{again}` fetches what is missing", error=True)

    def _results(
        self, events: Generator[Event[R], None, None], words: str
    ) -> Iterator[tuple[str, R | HostError]]:
        """The result of each host, while the size of all bags is shown."""
        sizes: dict[str, int] = {}
        away: set[str] = set()
        with closing(events) as reading, console.err().status(words) as progress:
            if not console.err().is_terminal:
                progress.stop()
            for event in reading:
                if isinstance(event, Finished):
                    yield event.host, event.outcome
                elif isinstance(event, Note) and event.text.isdigit():
                    sizes[event.host] = int(event.text)
                    progress.update(f"{view.size(sum(sizes.values()))} {words}")
                elif isinstance(event, Note) and event.host not in away:
                    away.add(event.host)
                    console.show(
                        f"{event.host}  not connected, trying again: {printable(event.text)}", error=True
                    )

    def _failure(self, host: str, recording: Recording) -> HostError | None:
        """Why a recorder has failed; None if it has not."""
        if recording.ended != "failed":
            return None
        middleware = middleware_at(self._swarm, host)
        status, package = recording.status, middleware.bag_recorder.package
        return ros_tools.lack(host, status, self._swarm.name, package, package, middleware) or HostError(
            Kind.FAILED, f"{package} ended with exit code {status}: {recording.output}"
        )

    def _fail(self, host: str, error: HostError) -> None:
        self._errors[host] = error
        console.show(
            f"{host}  {error.kind.value}: {printable(error.message.removeprefix(f'{host}: '))}", error=True
        )
        if error.hint:
            console.show(f"  help: {printable(self._complete(error.hint))}", error=True)
