"""How large the code is: Python files and lines by package, the largest files, and the import contracts.

``code_size.py [FOLDER ...]`` prints one column for each checkout, so that two versions stand side by side.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
AREAS = {"swarmctl": "swarmctl", "on robots": "templates", "tests": "tests", "benchmarks": "benchmarks"}
CONTRACT = re.compile(r'^type = "(layers|forbidden|acyclic_siblings)"', re.MULTILINE)
SKIPPED = {"__pycache__", ".venv", "data"}


def sources(folder: Path) -> Iterator[tuple[Path, int]]:
    """Every Python file below a folder, with its number of lines."""
    for path in sorted(folder.rglob("*.py")):
        if not SKIPPED & set(path.relative_to(folder).parts):
            yield path, len(path.read_text("utf-8").splitlines())


def figures(root: Path) -> dict[str, str]:
    """What is printed of one checkout, by its label."""
    found: dict[str, str] = {}
    for label, folder in AREAS.items():
        sizes = [lines for _, lines in sources(root / folder)]
        found[label] = f"{len(sizes)} files, {sum(sizes)} lines"
    lines: Counter[str] = Counter()
    files: Counter[str] = Counter()
    for path, count in sources(root / "swarmctl"):
        parts = path.relative_to(root / "swarmctl").parts
        package = parts[0] if len(parts) > 1 else "(top level)"
        lines[package] += count
        files[package] += 1
    found["packages"] = str(len(lines) - 1)
    largest, most = max(sources(root / "swarmctl"), key=lambda one: one[1])
    found["largest file"] = f"{largest.relative_to(root)}, {most} lines"
    folders = Counter(path.parent.relative_to(root) for path, _ in sources(root / "swarmctl"))
    fullest, count = folders.most_common(1)[0]
    found["most files in a folder"] = f"{fullest}, {count} files"
    kinds = Counter(CONTRACT.findall((root / "pyproject.toml").read_text("utf-8")))
    found["import contracts"] = ", ".join(f"{count} {kind}" for kind, count in sorted(kinds.items()))
    return found | {f"swarmctl/{name}": f"{files[name]} files, {lines[name]} lines" for name in sorted(lines)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkouts", nargs="*", type=Path, default=[ROOT])
    columns = [figures(root) for root in parser.parse_args().checkouts]
    labels = list(dict.fromkeys(label for column in columns for label in column))
    widths = [max(len(value) for value in column.values()) for column in columns]
    for label in labels:
        cells = (f"{column.get(label, '-'):<{width}}" for column, width in zip(columns, widths, strict=True))
        print(f"{label:<26}", *cells)


if __name__ == "__main__":
    main()
