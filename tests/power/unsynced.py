"""``python -m tests.power.unsynced``: takes away each sync of the agent in turn: power cuts must show it."""

from __future__ import annotations

import argparse
import ast
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from tests import ROOT
from tests.power import isolated
from tests.power.cuts import REACHED

AGENT = "templates/onboard/swarm_onboard/agent"
_FOLDERS = ("swarmctl", "templates", "schemas", "tests/power", "tests/onboard/agent")
_FILES = ("tests/__init__.py", "tests/timing.py", "tests/onboard/__init__.py")
#: What cuts leave of the log; with a flushed one each cut leaves another image, and takes its time.
_LOGS = (("--log=lost", "--log=once"), ("--log=flushed", "--sparse=8"))
#: The syncs that no cut shows, each with why it stays.
NEEDLESS = {
    "known_keys 1: files.sync(folder(home))": "later syncs of the request write its name, too",
    "known_keys 2: files.sync(place)": "the sync of a new folder writes its name; POSIX does not promise it",
    "wireguard_key 1: files.sync(known_keys.folder(home))": "the verb syncs that folder before it answers",
    "wireguard_key 3: files.sync(os.path.dirname(private))": "the verb syncs that folder before it answers",
}


class Sync(NamedTuple):
    """A statement of the agent that waits for the disk: its file, its place there, from 0, and its text."""

    file: str
    number: int
    text: str
    span: tuple[int, int, int]  # line, first and last column

    @property
    def name(self) -> str:
        """Its name in tables and in ``NEEDLESS``."""
        return f"{self.file.removesuffix('.py')} {self.number + 1}: {self.text}"


def syncs() -> list[Sync]:
    """Returns every sync of the agent."""
    root = ROOT / AGENT
    return [one for path in sorted(root.rglob("*.py")) for one in _of(path, str(path.relative_to(root)))]


def _of(path: Path, name: str) -> Iterator[Sync]:
    text = path.read_text()
    number = 0
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Expr)]
    for node in sorted(nodes, key=lambda node: node.lineno):
        if isinstance(node.value, ast.Call):
            called = node.value.func
            if getattr(called, "attr", getattr(called, "id", "")) in ("sync", "sync_disk"):
                assert node.end_lineno == node.lineno
                assert node.end_col_offset is not None
                span = (node.lineno, node.col_offset, node.end_col_offset)
                yield Sync(name, number, ast.unparse(node), span)
                number += 1


def copy_without(taken: Iterable[Sync], root: Path) -> None:
    """Makes ``root`` a copy of what power cuts need, whose agent does not wait for the disk at ``taken``."""
    for folder in _FOLDERS:
        shutil.copytree(ROOT / folder, root / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in _FILES:
        shutil.copy(ROOT / name, root / name)
    for one in taken:
        path = root / AGENT / one.file
        lines = path.read_text().split("\n")
        line, start, end = one.span
        lines[line - 1] = f"{lines[line - 1][:start]}open({REACHED!r}, 'w').close(){lines[line - 1][end:]}"
        path.write_text("\n".join(lines))


def cut(root: Path, *options: str) -> list[dict[str, Any]]:
    """Returns the rows of the power cuts that ``root`` has. Raises ``RuntimeError`` without any."""
    command = [sys.executable, "-m", "tests.power", "--json", "--jobs=1", *options]
    environment = {**os.environ, "PYTHONPATH": str(root / "templates/onboard")}
    done = subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, check=False)
    if not done.stdout:
        raise RuntimeError(done.stderr)
    rows: list[dict[str, Any]] = json.loads(done.stdout)
    return rows


def found(one: Sync, options: Sequence[str]) -> str:
    """Returns what the first cut that shows the loss of a sync says; empty if none does."""
    with tempfile.TemporaryDirectory() as folder:
        copy_without([one], Path(folder))
        for logs in _LOGS:
            rows = cut(Path(folder), "--first", "--random=0", "--deploys-each=1000000", *logs, *options)
            if problem := next((problem for row in rows for problem in row["wrong"]), ""):
                return problem
    return ""


def main() -> int:
    """Returns 1 if no cut shows the loss of a sync, or one shows that of a sync in ``NEEDLESS``."""
    parser = argparse.ArgumentParser(prog="python -m tests.power.unsynced", description=__doc__)
    parser.add_argument("--only", default="", metavar="TEXT", help="the syncs whose name has TEXT")
    parser.add_argument("--jobs", type=int, default=2)
    chosen, options = parser.parse_known_args()
    if lacks := isolated.missing():
        sys.exit(f"power cuts need {lacks}")
    taken = [one for one in syncs() if chosen.only in one.name]
    wrong = 0
    with ThreadPoolExecutor(chosen.jobs) as pool:
        for one, problem in zip(taken, pool.map(lambda one: found(one, options), taken), strict=True):
            reason = NEEDLESS.get(one.name, "")
            wrong += bool(problem) == bool(reason)
            print(f"{one.name}\n    {problem or reason or 'NO CUT SHOWS IT'}"[:300], flush=True)
    print(f"{len(taken)} syncs, each taken away in turn: {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
