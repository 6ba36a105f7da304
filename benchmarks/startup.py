"""How long ``swarmctl`` takes to say anything: ``python benchmarks/startup.py [--check]``.

Whole processes, their median and spread, and the ratio to ``python -c pass`` measured in turn with them.
"""

from __future__ import annotations

import argparse
import statistics
import subprocess
import sys
import time
from pathlib import Path

BAR = 0.15  # s
HELD = (
    "swarmctl --version",
    "swarmctl --help",
)  # a verb's own help also loads typer's converters, pydantic with them
PROGRAM = str(Path(sys.executable).with_name("swarmctl"))
BARE = "python -c pass"


def commands() -> dict[str, list[str]]:
    """What is measured, by the name it has in the table."""
    from swarmctl.cli.app import app

    verbs = [one.name or one.callback.__name__ for one in app.registered_commands if one.callback]
    groups = [one.name for one in app.registered_groups if one.name]
    commands = [["--version"], ["--help"], *([verb, "--help"] for verb in [*verbs, *groups])]
    return {BARE: [sys.executable, "-c", "pass"]} | {
        " ".join(["swarmctl", *words]): [PROGRAM, *words] for words in commands
    }


def seconds(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def measured(commands: dict[str, list[str]], runs: int) -> dict[str, list[float]]:
    """All commands in turn, so that a busy moment strikes all alike; the first round is not counted."""
    rounds = [{name: seconds(command) for name, command in commands.items()} for _ in range(runs + 1)]
    return {name: sorted(one[name] for one in rounds[1:]) for name in commands}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=15, help="runs of each command")
    parser.add_argument(
        "--check", action="store_true", help=f"exit 1 when --version or --help takes longer than {BAR} s"
    )
    given = parser.parse_args()
    times = measured(commands(), given.runs)
    base = statistics.median(times[BARE])
    width = max(map(len, times))
    print(f"{'':{width}}  median    best   worst   ratio   (s, {given.runs} runs; bar {BAR} s)")
    slow = []
    for name, each in times.items():
        median = statistics.median(each)
        over = name in HELD and median > BAR
        if over:
            slow.append(name)
        print(
            f"{name:{width}}  {median:6.3f}  {each[0]:6.3f}  {each[-1]:6.3f}  {median / base:5.1f}x"
            f"{'  over the bar' if over else ''}"
        )
    return 1 if slow and given.check else 0


if __name__ == "__main__":
    sys.exit(main())
