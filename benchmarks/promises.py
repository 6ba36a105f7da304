"""Times that swarmctl promises, with their bars: ``python benchmarks/promises.py`` (the lab needs root).

Runs the tests of these times, on a quiet machine, one at a time. Exits with 1 if a time is over its bar.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tests", nargs="*", default=["tests"], help="files or folders of tests; all, without")
    tests = parser.parse_args(arguments).tests
    argv = [sys.executable, "-m", "pytest", "--bars", *tests]
    return subprocess.run(argv, cwd=Path(__file__).parents[1], check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
