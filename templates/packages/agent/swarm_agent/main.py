"""Reads requests from standard input and answers them one after the other."""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import contextmanager, suppress
from typing import Any, Iterator

from .errors import OperatorGoneError, RefusedError
from .rpc import Report, requests


def serve(nonce: str) -> None:
    """Answers the requests on standard input until it ends."""
    os.umask(0o022)
    os.chdir("/")
    # An invalid request ends the agent: the start of the next one is unknown.
    with suppress(OperatorGoneError), _reporting(nonce):
        for request, payload in requests(sys.stdin.buffer):
            with _reporting(nonce) as report:
                report.answer(_handle(request, payload, report))


def _handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    verb = str(request.get("verb"))
    if not verb.isidentifier():
        raise RefusedError(f"{verb!r} is no verb")
    answer: dict[str, Any] = importlib.import_module("swarm_agent.verbs." + verb).handle(
        request, payload, report
    )
    return answer


@contextmanager
def _reporting(nonce: str) -> Iterator[Report]:
    """Yields a report, and sends an exception of the block as an error."""
    report = Report(nonce)
    try:
        yield report
    except RefusedError as error:
        report.error(error.kind, error.message, error.hint)
    except OSError as error:
        sys.excepthook(*sys.exc_info())  # prints it as `traceback` does, which takes long to load
        report.error("failed", str(error), "look at the host's disk and its system log")
    except (ValueError, TypeError, KeyError, AttributeError, ImportError) as error:
        sys.excepthook(*sys.exc_info())
        report.error("protocol", f"{type(error).__name__}: {error}", "is swarmctl intact?")
    finally:
        report.close()
