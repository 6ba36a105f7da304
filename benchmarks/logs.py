"""What `swarmctl logs` costs: ``python benchmarks/logs.py [--hosts N] [--rounds N]``.

As root, in a lab of N deployed hosts: the verb as a person runs it, beside a loop of ``ssh HOST journalctl``,
one host after the other, which prints the same lines in no common order.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from deploy import await_rest, deployed, spec_of
from status import seconds

from swarmctl.lab import lab, paths

JOURNAL = "sudo -n journalctl -q -o short-iso-precise -n 200 -u 'swarm-bench.*'"


def ran(argv: Sequence[str]) -> None:
    """Runs a command to its end. Raises SystemExit if it fails or prints nothing."""
    done = subprocess.run(argv, capture_output=True, text=True, check=False)
    if done.returncode or not done.stdout:
        raise SystemExit(f"{argv[0]} ended with {done.returncode}: {done.stderr}")


def rounds_of(spec: Path, rounds: int) -> list[tuple[float, float]]:
    """The s of the loop and of the verb, round by round."""
    with deployed(spec) as (targets, _):
        name = f"bench-{os.getpid()}"
        loop = [lab.ssh_argv(name, target.host, [JOURNAL]) for target in targets]
        verb = [sys.executable, "-m", "swarmctl", "logs", str(spec), "--lab-name", name]
        found = []
        for _ in range(rounds + 1):
            await_rest()
            by_loop = seconds(lambda: [ran(one) for one in loop])
            found.append((by_loop, seconds(lambda: ran(verb))))
        return found[1:]  # the first warms up


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--hosts", type=int, default=10)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="swarm-bench-") as folder:
        os.environ.setdefault(paths.STATE_VARIABLE, folder)
        spec = Path(folder, "swarm.yaml")
        spec.write_text(spec_of(given.hosts))
        found = rounds_of(spec, given.rounds)
    by_loop, by_verb = (statistics.median(one) for one in zip(*found, strict=True))
    ratio = statistics.median(verb / loop for loop, verb in found)
    print(f"{given.hosts} hosts, {given.rounds} rounds, median")
    print(f"  ssh HOST journalctl, in a loop  {by_loop:6.2f} s")
    print(f"  swarmctl logs                   {by_verb:6.2f} s")
    print(f"  {ratio:.2f} x the loop")
    return 0


if __name__ == "__main__":
    sys.exit(main())
