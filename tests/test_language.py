"""Plain English in everything that a person reads: names, docstrings, comments, messages and pages."""

from __future__ import annotations

import ast
import re
import subprocess
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests import ROOT

#: Verbs of speech for data flow, and nouns that only this project ever used.
WORDS = re.compile(
    r"(?<![A-Za-z])(told|tells?|telling|mend(?:s|ed|ing)?|hears?|heard|hearing|said|asked|unasked|house|rooms?)(?![A-Za-z])",
    re.I,
)
#: Names of before, where CHANGELOG.md lists what is renamed.
ALLOWED = (
    *(
        "`mend`",
        "`hears orders`",
        "`asked`",
        "`hears`",
        "`tells`",
        "`told`",
        "`unasked()`",
        "`unasked_due()`",
    ),
    "asked_",  # of the rover's sketch: another byte there means to flash every board again
)
FOLDERS = (
    *(
        "swarmctl/*/",
        "swarmctl/cli/verbs/",
        "templates/*/",
        "templates/onboard/swarm_onboard/*/",
        "tests/*/",
        "tests/onboard/*/",
    ),
    *("benchmarks/", "docs/", "examples/"),
)
REST = "./"  # all other files
LONGEST_NAME = 60
#: A character class, a repetition or an anchor: what no user should have to read.
RAW_REGEX = re.compile(r"\[\^?(?:a-z|A-Z|0-9)|\]\{\d|\(\?[:=!]|\\d")
#: What helps somebody who writes a pattern of their own shows one.
OF_PATTERNS = ("[0-9], a group ( )", "(-?[0-9]+)")


@cache
def files() -> dict[str, list[Path]]:
    """The text files that git knows, by the innermost folder of `FOLDERS` that holds them."""
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    folders = {f"{one.relative_to(ROOT)}/": [] for glob in FOLDERS for one in ROOT.glob(glob) if one.is_dir()}
    folders[REST] = []
    for name in listed.splitlines():
        homes = [folder for folder in folders if name.startswith(folder)] or [REST]
        if name != "tests/test_language.py" and (ROOT / name).is_file():
            folders[max(homes, key=len)].append(ROOT / name)
    return folders


def text_of(file: Path) -> str:
    try:
        return file.read_text("utf-8")
    except UnicodeDecodeError:  # a picture, a captured line
        return ""


@pytest.mark.parametrize("folder", sorted(files()))
def test_it_speaks_of_data_as_engineers_do(folder: str) -> None:
    found = []
    for file in files()[folder]:
        for number, line in enumerate(text_of(file).splitlines(), 1):
            shown = line
            for phrase in ALLOWED:
                shown = shown.replace(phrase, "")
            if WORDS.search(shown):
                found.append(f"{file.relative_to(ROOT)}:{number}: {line.strip()[:120]}")
    assert found == []


def names_of_tests(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(text_of(file))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name.startswith("test_"):
            yield node.name


@pytest.mark.parametrize("folder", sorted(one for one in files() if one.startswith("tests/")))
def test_names_of_tests_are_short(folder: str) -> None:
    names = (name for file in files()[folder] if file.suffix == ".py" for name in names_of_tests(file))
    assert [name for name in names if len(name.removeprefix("test_")) > LONGEST_NAME] == []


def test_no_module_name_means_two_things() -> None:
    """A verb, a view, a rule and a check may share their name with what they are about."""
    modules = [one.relative_to(ROOT / "swarmctl") for one in (ROOT / "swarmctl").rglob("*.py")]
    shared = ("cli/verbs/", "views/", "rules/", "health/checks/")
    counted = Counter(
        one.stem for one in modules if not str(one).startswith(shared) and one.stem != "__init__"
    )
    assert [name for name, count in counted.items() if count > 1] == []


def test_no_message_shows_a_regular_expression() -> None:
    """A sentence has words around it; a pattern that is compiled has none."""
    found = []
    for file in (ROOT / "swarmctl").rglob("*.py"):
        for node in ast.walk(ast.parse(text_of(file))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                sentence = len(re.findall(r"(?:^| )[A-Za-z]{2,}(?= |$)", node.value)) >= 3
                if (
                    sentence
                    and RAW_REGEX.search(node.value)
                    and not any(one in node.value for one in OF_PATTERNS)
                ):
                    found.append(f"{file.relative_to(ROOT)}:{node.lineno}: {node.value[:100]}")
    assert found == []
