"""Looks locked packages up among known vulnerabilities, by pip-audit; what was not checked is a failure."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

VULNERABLE, UNCHECKED = 1, 2


def verdict(report: dict[str, Any]) -> tuple[int, list[str]]:
    """The exit code and the lines for a report of pip-audit, which exits with 0 even if it skipped all."""
    packages = report["dependencies"]
    skipped = [one for one in packages if "skip_reason" in one]
    found = [
        f"{one['name']} {one['version']}: {fault['id']}, fixed in "
        f"{', '.join(fault['fix_versions']) or 'no version'}"
        for one in packages
        for fault in one.get("vulns", ())
    ]
    if len(skipped) == len(packages):
        return UNCHECKED, ["nothing was checked: the vulnerability service has none of the packages"]
    if skipped:
        found += [f"not checked: {one['skip_reason']}" for one in skipped]
        return UNCHECKED, found
    return (VULNERABLE, found) if found else (0, [f"{len(packages)} packages: no known vulnerabilities"])


def main(requirements: str) -> int:
    command = [sys.executable, "-m", "pip_audit", "-r", requirements, "--require-hashes", "--disable-pip"]
    audit = subprocess.run(
        [*command, "-f", "json", "--progress-spinner", "off"], capture_output=True, text=True, check=False
    )
    try:
        code, lines = verdict(json.loads(audit.stdout))
    except ValueError:
        last = audit.stderr.strip().rpartition("\n")[2]
        code, lines = UNCHECKED, [f"nothing was checked: {last}"]
    print("\n".join(f"-- {requirements}: {line}" for line in lines))
    return code


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
