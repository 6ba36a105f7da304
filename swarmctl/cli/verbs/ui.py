"""``swarmctl ui``: a local web page with the graph and the health of the swarm."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from swarmctl.cli import console, exit_codes, extras, options, swarm_look
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.health.expected_graph import ExpectedGraph
    from swarmctl.swarm.topic_island import MotionTopics
    from swarmctl.ui.bags import Row
    from swarmctl.ui.server import Pages
    from swarmctl.ui.watch import Watch

_OFTEN, _SELDOM = 0.2, 1.0  # s between two messages to the pages, at least and at most


@with_where(spec=options.SpecOrReport)
def ui(
    where: Where,
    archive: options.Archive = None,
    bags: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Replay a recorded run, from its bags; connect to no host."),
    ] = None,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on 127.0.0.1; 0: a free one.")] = 0,
    control: Annotated[
        bool, typer.Option("--control", help="The page has buttons that stop robots and release them.")
    ] = False,
) -> None:
    """Serve a local web page that shows the swarm: its graph and its health, live, until Ctrl-C.

    Only this machine reaches the page, by the URL that is printed. Hosts are looked at while a page is open.
    """
    extras.need("ui", "ui", "starlette", "uvicorn", "websockets")
    if bags is not None:
        extras.need("--bags", "ui", "rosbags")
    if (archive or bags) and (control or where.in_lab):
        shown = "--from shows what is in the archive" if archive else "--bags shows what is in the bags"
        console.fail(f"{shown}, and connects to no host", code=exit_codes.USAGE)
    if archive is not None:
        _show_archive(archive, bags, port)
    if bags is not None:
        _show_run(where.spec, bags, port)
    _show_hosts(where, port, control=control)


def _show_hosts(where: Where, port: int, *, control: bool) -> NoReturn:
    from swarmctl.analysis.diagram import diagram
    from swarmctl.cli.ssh_targets import transport
    from swarmctl.ui import messages
    from swarmctl.ui.control import Control
    from swarmctl.ui.server import Pages
    from swarmctl.ui.watch import Watch
    from swarmctl.views.graph import page

    looked = swarm_look.expected(where)
    pages = Pages(("log", "stop", "start") if control else ("log",))
    live = page.Live(messages.starts(looked.document.spec), control)
    # The server comes first: --lab moves this thread, not its socket, into the network of the lab.
    with _served(page.graph(diagram(looked.index), live), pages, port) as url:
        targets = where.targets(looked.swarm)
        connections = transport()
        watch = Watch(
            looked.graph,
            targets,
            connections,
            lambda note: pages.send("telemetry", messages.telemetry(note)),
        )
        homes = {robot.name: host.name for host in looked.graph.hosts for robot in host.robots}
        robots = Control(looked.swarm.name, homes, targets, connections)
        _answer(pages, partial(_log, looked.graph, watch), robots.do)
        with _shown(url):
            while True:
                if not pages.opened.wait(_SELDOM):
                    continue
                watch.start()
                try:
                    while pages.opened.is_set():
                        seen = watch.wait(_SELDOM)
                        if seen is not None:
                            pages.send("status", messages.status(looked.status(seen.outcomes), seen.age))
                            time.sleep(_OFTEN)
                finally:
                    watch.stop()


def _show_run(spec: SpecFiles, bags: Path, port: int) -> NoReturn:
    from swarmctl.analysis.diagram import diagram
    from swarmctl.swarm.index import SwarmIndex
    from swarmctl.swarm.topic_island import motion_topics
    from swarmctl.ui import messages
    from swarmctl.ui.server import Pages
    from swarmctl.views.graph import page

    document = console.read_document(spec)
    run = _run(bags, motion_topics(console.swarm_of(document)))
    replay = page.Live(messages.starts(document.spec), run=run)
    with _served(page.graph(diagram(SwarmIndex(document)), replay), Pages(), port) as url, _shown(url):
        while True:
            time.sleep(_SELDOM)


def _run(bags: Path, topics: Mapping[str, MotionTopics]) -> dict[str, list[Row]]:
    """How these robots moved, from bags. Names those that cannot be read; exits if nothing is left."""
    from swarmctl.ui.bags import read
    from swarmctl.views.escape import printable

    console.show(f"reading {printable(str(bags))} ...", error=True)
    try:
        run = read(bags, topics)
    except OSError as error:
        console.fail(f"{bags}: {error.strerror}")
    for trouble in run.troubles:
        console.show(f"warning: {printable(trouble)}", error=True)
    if not run.rows:
        console.fail(f"{bags} has no bag with a topic of a robot of the swarm")
    return run.rows


def _show_archive(archive: Path, bags: Path | None, port: int) -> NoReturn:
    from swarmctl.health import report_archive
    from swarmctl.ui import messages
    from swarmctl.ui.server import Pages
    from swarmctl.views.graph import page

    try:
        look = report_archive.read(archive).look
        drawing, entries = report_archive.graph_and_logs(archive)
        topics, starts = report_archive.motion(archive) if bags else ({}, {})
    except report_archive.ReportError as error:
        console.fail(str(error), "`swarmctl report` writes one")
    run = _run(bags, topics) if bags else None
    pages = Pages(("log",))
    taken = datetime.fromtimestamp(look.began).astimezone()
    live = page.Live(starts, taken=f"{taken:%Y-%m-%d %H:%M:%S %z}", run=run)
    with _served(page.graph(drawing, live), pages, port) as url:
        _answer(pages, lambda names: messages.log_of(names[0], entries), lambda action, names: ())
        with _shown(url):
            while True:
                if not pages.opened.wait(_SELDOM):
                    continue
                pages.send("status", messages.status(look.status, 0.0))
                time.sleep(_SELDOM)


@contextmanager
def _served(html: str, pages: Pages, port: int) -> Iterator[str]:
    """Serves the page meanwhile; yields its URL. Exits if the port is in use."""
    from swarmctl.ui.server import serving

    with ExitStack() as stack:
        try:
            url = stack.enter_context(serving(html, pages, port))
        except OSError as error:
            console.fail(f"--port {port}: {error.strerror or error}", "choose another port, or 0")
        yield url


@contextmanager
def _shown(url: str) -> Iterator[None]:
    """Prints where the page is, which is there until Ctrl-C."""
    with console.until_ctrl_c():
        print(url, flush=True)
        console.err().print("the page shows the swarm while it is open; Ctrl-C ends this")
        yield


def _answer(
    pages: Pages,
    log: Callable[[list[str]], dict[str, Any]],
    do: Callable[[str, list[str]], Iterable[str]],
) -> None:
    """Does what pages ask for, each in a thread of its own: a stop waits for nothing."""
    from swarmctl.remote.parallel_hosts import bugs_as_errors
    from swarmctl.remote.transport import HostError

    def answer(action: str, names: list[str]) -> None:
        try:
            with bugs_as_errors(action):
                if action == "log":
                    pages.send("log", log(names))
                    return
                for line in do(action, names):
                    pages.send("result", {"text": line})
        except HostError as error:
            if action == "log":
                pages.send("log", {"node": "".join(names), "lines": [], "trouble": str(error)})
            else:
                pages.send("result", {"text": str(error)})

    def take() -> None:
        while True:
            threading.Thread(target=answer, args=pages.requests.get(), daemon=True).start()

    threading.Thread(target=take, daemon=True).start()


def _log(graph: ExpectedGraph, watch: Watch, names: list[str]) -> dict[str, Any]:
    """The last entries of a robot, a program or a host, ``robot:k3``, as the page gets them.

    Raises ``HostError``.
    """
    from swarmctl.ui import messages

    node = names[0]
    for host in graph.hosts:
        parts = {f"robot:{one.name}": [one.name] for one in host.robots}
        parts |= {f"program:{one.name}": [one.name] for one in host.programs}
        parts[f"host:{host.name}"] = []
        if node in parts:
            return messages.log(node, watch.log(host.name, parts[node]))
    return {"node": node, "lines": [], "trouble": "no host has its log"}
