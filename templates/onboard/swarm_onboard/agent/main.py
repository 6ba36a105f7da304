"""Reads requests from standard input and answers them one after the other."""

from __future__ import annotations

import importlib
import os
import sys
from contextlib import contextmanager, suppress

from . import disk
from .errors import OperatorGoneError, RefusedError, UploadEndedError
from .paths import ROOT
from .rpc import Report, requests

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Iterator


def serve(nonce: str) -> None:
    """Answers the requests on standard input until it ends."""
    os.chdir("/")
    # An invalid request ends the agent: the start of the next one is unknown.
    with suppress(OperatorGoneError), _reporting(nonce):
        try:
            for request, payload in requests(sys.stdin.buffer):
                with _reporting(nonce) as report:
                    report.answer(_handle(request, payload, report))
        except UploadEndedError as error:
            interrupted = getattr(_verb(error.request), "interrupted", None)
            if interrupted is not None:
                interrupted(_typed(error.request), error.received)
            raise


def _handle(request: dict[str, Any], payload: bytes, report: Report) -> dict[str, Any]:
    answer: Any = _verb(request).handle(_typed(request), payload, report)
    found: dict[str, Any] = answer._asdict() if hasattr(answer, "_asdict") else answer
    return found


def _typed(request: dict[str, Any]) -> Any:
    """The request as a value of its verb's type."""
    verb = _verb(request)
    fields = {name: value for name, value in request.items() if name not in ("verb", "payload")}
    return verb.Request(**fields) if hasattr(verb, "Request") else request


def _verb(request: dict[str, Any]) -> Any:
    verb = str(request.get("verb"))
    if not verb.isidentifier():
        raise RefusedError(f"{verb!r} is not a verb")
    return importlib.import_module("swarm_onboard.agent.verbs." + verb)


@contextmanager
def _reporting(nonce: str) -> Iterator[Report]:
    """Yields a report, and sends an exception of the block as an error."""
    report = Report(nonce)
    try:
        yield report
    except RefusedError as error:
        report.error(error.kind, error.message, error.hint)
    except OSError as error:
        if disk.is_full(error):
            place = str(error.filename or ROOT)
            full = disk.full(place, f"writing {place}")
            report.error(full.kind, full.message, full.hint)
            return
        sys.excepthook(*sys.exc_info())  # prints it as `traceback` does, which takes long to load
        report.error("failed", str(error), "look at the host's disk and its system log")
    except (ValueError, TypeError, KeyError, AttributeError, ImportError) as error:
        sys.excepthook(*sys.exc_info())
        report.error("protocol", f"{type(error).__name__}: {error}", "is swarmctl intact?")
    finally:
        report.close()
