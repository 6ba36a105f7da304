"""Hostile input gets an answer: exit code 0 or 1, no traceback, bounded work and memory; inputs are counted.

``make fuzz`` runs many more examples (SWARMCTL_FUZZ, examples of each property).
"""

from __future__ import annotations

import os
import re
import select
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.linter.runner import lint
from swarmctl.spec.catalog import load_catalog
from swarmctl.spec.load import load_text
from tests import ROOT
from tests.timing import PATIENCE, reference, work_at_most
from tests.yamltext import hostile_inputs

EXAMPLES = int(os.environ.get("SWARMCTL_FUZZ", "200"))
REFERENCES, MEGABYTES = 2000, 200
CATALOG = load_catalog()
LINES = hostile_inputs.EXAMPLE.splitlines(keepends=True)
PIECES = [
    *(
        "{",
        "}",
        "[",
        "]",
        ":",
        ": ",
        ",",
        "- ",
        "? ",
        "\n",
        "\n  ",
        '"',
        "'",
        "&a ",
        "*a",
        "<<: ",
        "!x ",
        "#",
    ),
    *("|\n", ">-\n", "\t", "~", "0o17", "1e999", "012", "10:00:52:14:33:11", "no", "include: ", "hosts:\n"),
    *(
        "robots: ",
        "links:\n",
        "\r",
        "\ufeff",
        "\u202e",
        "\x00",
        "\ud800",
        "\U0001f916",
        "%",
        "---\n",
        "...\n",
    ),
]
SMALL = dict(hostile_inputs.small())
LARGE = dict(hostile_inputs.large())
#: Validates the spec of each folder that it reads, in a process of its own: one import serves all. Prints its
#: exit code, CPU time without that of the import in s, and memory in MiB.
VALIDATOR = f"""
import os, sys
from swarmctl.__main__ import main
from tests.loading import load_checked
from pathlib import Path
sys.argv = ["swarmctl", "validate", "swarm.yaml"]
load_checked(Path({str(ROOT / "examples/paper-leader/swarm.yaml")!r}))
for folder in iter(sys.stdin.readline, ""):
    child = os.fork()
    if not child:
        os.chdir(folder.strip())
        os.dup2(os.open("stderr", os.O_WRONLY | os.O_CREAT), 2)
        os.dup2(2, 1)
        os._exit(main())
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    print(os.waitstatus_to_exitcode(status), seconds, used.ru_maxrss / 1024, flush=True)
"""


@pytest.mark.parametrize("name", SMALL)
def test_small_hostile_files(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], counted: list[str]
) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_bytes(SMALL[name])
    assert run(["validate", str(spec)]) in (exit_codes.OK, exit_codes.ERROR)
    errors = capsys.readouterr().err
    assert "bug in swarmctl" not in errors
    assert not re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]", errors)
    counted.append(name)


@pytest.fixture(scope="module")
def validator() -> Iterator[subprocess.Popen[str]]:
    with subprocess.Popen(
        [sys.executable, "-c", VALIDATOR], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        yield process
        assert process.stdin is not None
        process.stdin.close()


@pytest.mark.parametrize("name", [*LARGE, *hostile_inputs.trees()])
@pytest.mark.slow
def test_large_hostile_files(
    name: str, tmp_path: Path, counted: list[str], validator: subprocess.Popen[str]
) -> None:
    files: Mapping[str, bytes] = (
        {"swarm.yaml": LARGE[name]()} if name in LARGE else hostile_inputs.trees()[name]
    )
    for file, content in files.items():
        (tmp_path / file).parent.mkdir(exist_ok=True)
        (tmp_path / file).write_bytes(content)
    assert validator.stdin is not None
    assert validator.stdout is not None
    print(tmp_path, file=validator.stdin, flush=True)
    answers, _, _ = select.select([validator.stdout], [], [], 10 * PATIENCE)  # what is bounded is CPU time
    assert answers, "no answer"
    code, seconds, megabytes = validator.stdout.readline().split()
    references = float(seconds) / reference()
    errors = (tmp_path / "stderr").read_text("utf-8")
    assert int(code) in (exit_codes.OK, exit_codes.ERROR)
    assert "bug in swarmctl" not in errors
    assert "Traceback" not in errors
    assert references <= REFERENCES
    assert float(megabytes) <= MEGABYTES * 1.1  # as much differs between builds of Python
    counted.append(name)


def answered(text: str, counted: list[str]) -> None:
    with work_at_most(100):
        document, found = load_text(text, "swarm.yaml", CATALOG)
        assert document is not None or found
        if document is not None:
            lint(document)
    counted.append(text[:20])


fuzzed = settings(
    max_examples=EXAMPLES,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@fuzzed
@given(st.lists(st.sampled_from([*PIECES, "a", "b", "1"]), max_size=40).map("".join))
def test_whatever_resembles_yaml(counted: list[str], text: str) -> None:
    answered(text, counted)


@fuzzed
@given(st.data())
def test_specs_with_pieces_changed(counted: list[str], data: st.DataObject) -> None:
    text = hostile_inputs.EXAMPLE
    for _ in range(data.draw(st.integers(1, 6))):
        at, length = data.draw(st.integers(0, len(text))), data.draw(st.integers(0, 15))
        text = text[:at] + data.draw(st.sampled_from(PIECES) | st.text(max_size=3)) + text[at + length :]
    answered(text, counted)


@fuzzed
@given(st.lists(st.sampled_from(LINES), max_size=40))
def test_specs_with_lines_exchanged(counted: list[str], lines: list[str]) -> None:
    answered("".join(lines), counted)


keys = st.sampled_from(["hosts", "robots", "links", "kind", "name", "host", "robot", "type", "address"])
trees = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda below: st.lists(below, max_size=3) | st.dictionaries(keys, below, max_size=4),
    max_leaves=8,
)


@fuzzed
@given(st.dictionaries(st.sampled_from(["version", "mode", "control"]) | keys, trees))
def test_trees_of_any_shape(counted: list[str], tree: dict[str, object]) -> None:
    answered(yaml.safe_dump(tree, allow_unicode=True), counted)
