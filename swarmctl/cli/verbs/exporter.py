"""``swarmctl exporter``: serves the health of the swarm to Prometheus."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated
from urllib.parse import urlsplit

import typer

from swarmctl.cli import console, exit_codes, extras, options, swarm_look
from swarmctl.cli.where import Where, with_where

if TYPE_CHECKING:
    from swarmctl.views.status_metrics import LastLook

_USUAL = "127.0.0.1:9842"


@with_where("limit", "parallel", "executor")
def exporter(
    where: Where,
    listen: Annotated[
        str, typer.Option(metavar="ADDRESS:PORT", help="Where Prometheus reaches /metrics.")
    ] = _USUAL,
    every: Annotated[
        float, typer.Option(min=1.0, metavar="SECONDS", help="Interval of the looks at the hosts.")
    ] = 30.0,
    window: options.Window = options.WINDOW,
) -> None:
    """Serve the health of the swarm to Prometheus, until Ctrl-C.

    A scrape gets the last look at the hosts, and waits for none of them.
    """
    extras.need("exporter", "metrics")
    from swarmctl.views.status_metrics import LastLook

    last = LastLook()
    # The server comes first: --lab moves this thread, not its socket, into the network of the lab.
    with _served(last, listen), where.transport() as transport:
        looking = swarm_look.looking(where, transport, window)
        console.err().print(f"serving http://{listen}/metrics, a look every {every:g} s; Ctrl-C ends it")
        with console.until_ctrl_c():
            while True:
                due = time.monotonic() + every
                last.look = looking()
                time.sleep(max(0.0, due - time.monotonic()))


@contextmanager
def _served(last: LastLook, listen: str) -> Iterator[None]:
    """Serves the last look meanwhile, in a thread of its own."""
    import prometheus_client

    from swarmctl.views import status_metrics

    address, port = _address(listen)
    try:
        server, thread = prometheus_client.start_http_server(port, address, status_metrics.registry(last))
    except OSError as error:
        console.fail(f"--listen {listen}: {error.strerror or error}", "choose another address or port")
    try:
        yield
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def _address(listen: str) -> tuple[str, int]:
    """Address and port of ``--listen``; exits if it is none."""
    try:
        parts = urlsplit(f"//{listen}")
        address, port = parts.hostname, parts.port
    except ValueError:
        address = port = None
    if not address or not port or parts.netloc != listen or "@" in listen:
        usage = f"`{listen}` is no address to listen at"
        console.fail(usage, f"write ADDRESS:PORT, as in `--listen {_USUAL}`", code=exit_codes.USAGE)
    return address, port
