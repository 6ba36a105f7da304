"""The archive of a report, as bytes: its texts without the values of secrets, and its status read again."""

from __future__ import annotations

import gzip
import io
import json
import re
import tarfile
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarmctl.analysis.diagram import Diagram
from swarmctl.health.host_logs import Entry
from swarmctl.health.swarm_health import Look, Status
from swarmctl.swarm.topic_island import MotionTopics

MOST_BYTES = 64 << 20  # of an archive, unpacked
STATUS, LOOK, GRAPH, LOGS = "status.json", "look.json", "graph.json", "logs.jsonl"
MOTION = "motion.json"  # the topics on how robots move, and their start poses
_SHORTEST_LINE = 8  # characters of a line that is kept secret for itself, as one of a key in PEM
_BROKEN = (OSError, EOFError, zlib.error, tarfile.TarError, ValueError, TypeError, KeyError, RecursionError)


class ReportError(Exception):
    """A file that is not a report, or a damaged one."""


@dataclass(frozen=True)
class Report:
    """A look, the files of the spec, and the options that chose its hosts."""

    look: Look
    spec: tuple[Path, ...]
    where: list[str]


def remover(secrets: Mapping[str, str]) -> Callable[[Any], Any]:
    """A function that puts ``(secret NAME)`` in place of each value in the strings of a JSON value.

    Of a value with several lines, long ones are replaced alone, too. Numbers stay: they hold no secrets.
    """
    names: dict[str, str] = {}
    for name, value in secrets.items():
        lines = [line.strip() for line in value.splitlines()]
        for part in (value, value.strip(), *(line for line in lines if len(line) >= _SHORTEST_LINE)):
            names.setdefault(part, name)
    parts = sorted(filter(None, names), key=len, reverse=True)
    pattern = re.compile("|".join(map(re.escape, parts)) if parts else r"(?!)")

    def removed(value: Any) -> Any:
        if isinstance(value, str):
            return pattern.sub(lambda found: f"(secret {names[found[0]]})", value)
        if isinstance(value, Mapping):
            return {removed(key): removed(one) for key, one in value.items()}
        return [removed(one) for one in value] if isinstance(value, list | tuple) else value

    return removed


def packed(folder: str, texts: Mapping[str, str], at: float) -> bytes:
    """The archive, a tar.gz, of these texts by name, in one folder; ``at``: their time, s since 1970."""
    archive = io.BytesIO()
    with tarfile.open(fileobj=archive, mode="w:gz") as tar:
        for name, text in texts.items():
            data = text.encode()
            entry = tarfile.TarInfo(f"{folder}/{name}")
            entry.size, entry.mtime = len(data), int(at)
            tar.addfile(entry, io.BytesIO(data))
    return archive.getvalue()


def read(file: Path) -> Report:
    """The status in an archive, read in memory within ``MOST_BYTES``. Raises ``ReportError``."""
    with _opened(file) as tar:
        look = json.loads(_text(tar, LOOK))
        seen = Status.from_json(json.loads(_text(tar, STATUS)))
        shown = Look(seen, float(look["began"]), float(look["took"]))
        return Report(shown, tuple(map(Path, look["spec"])), list(map(str, look["where"])))


def graph_and_logs(file: Path) -> tuple[Diagram, list[Entry]]:
    """The graph and the logs in an archive, in the order of time. Raises ``ReportError``."""
    with _opened(file) as tar:
        entries = [Entry(**json.loads(line)) for line in _text(tar, LOGS).splitlines()]
        return Diagram.from_json(json.loads(_text(tar, GRAPH))), entries


def motion(file: Path) -> tuple[dict[str, MotionTopics], dict[str, tuple[float, float, float]]]:
    """By robot, the topics on how it moves, and its start pose in m, m and rad. Raises ``ReportError``."""
    with _opened(file) as tar:
        data = json.loads(_text(tar, MOTION))
        topics = {name: MotionTopics(**one) for name, one in data["topics"].items()}
        starts = {name: (float(x), float(y), float(yaw)) for name, (x, y, yaw) in data["starts"].items()}
        return topics, starts


@contextmanager
def _opened(file: Path) -> Iterator[tarfile.TarFile]:
    """An archive, unpacked in memory. Raises ``ReportError``, also for what the block finds broken."""
    try:
        with gzip.open(file) as stream:
            data = stream.read(MOST_BYTES + 1)
        if len(data) > MOST_BYTES:
            raise ReportError(f"{file} has more than {MOST_BYTES >> 20} MB")
        with tarfile.open(fileobj=io.BytesIO(data), mode="r:") as tar:
            yield tar
    except FileNotFoundError:
        raise ReportError(f"{file} does not exist") from None
    except _BROKEN:
        raise ReportError(f"{file} is not a report of this version of swarmctl, or it is damaged") from None


def _text(tar: tarfile.TarFile, name: str) -> bytes:
    """The file ``name`` in the archive's folder."""
    entry = next(one for one in (*tar.getmembers(), None) if one is None or _is(one, name))
    stream = tar.extractfile(entry) if entry else None
    if stream is None:
        raise ValueError(name)
    return stream.read()


def _is(entry: tarfile.TarInfo, name: str) -> bool:
    return entry.isfile() and entry.name.count("/") == 1 and entry.name.endswith(f"/{name}")
