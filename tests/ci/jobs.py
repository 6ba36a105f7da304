"""Scripts run as CI runs them, files judged as CI judges them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

from tests import ROOT

THIS_CHECKOUT = f'PYTHONPATH={ROOT}:{ROOT}/templates/onboard exec python -m swarmctl "$@"'  # as a script


def ran(script: str, folder: Path, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """A script as GitHub runs `shell: bash`, and GitLab where the image has a bash."""
    bash = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
    return subprocess.run(bash, cwd=folder, env=env, capture_output=True, text=True, check=False)


def program(path: Path, script: str) -> Path:
    """A program that stands in for another one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"#!/bin/sh\n{script}\n", "utf-8")
    path.chmod(0o755)
    return path


def checks(kind: str, file: Path) -> subprocess.CompletedProcess[str]:
    """A file against a schema that check-jsonschema brings along."""
    program = [sys.executable, "-m", "check_jsonschema", "--builtin-schema", f"vendor.{kind}", str(file)]
    return subprocess.run(program, capture_output=True, text=True, check=False)


def without_index(output: str) -> bool:
    """Whether pip failed because it reaches no package index."""
    return bool(re.search(r"No matching distribution|Could not find a version|Failed to establish", output))
