"""A finding can be accepted, with a reason, and only where that makes sense."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl import resources
from tests.loading import load_swarm

FAST = "k3: {type: khepera3, host: k3-pi, settings: {limits: {linear: 9.0}}}"
SLOW = "k3: {type: khepera3, host: k3-pi}"


@pytest.fixture
def spec(leader_spec: Path) -> str:
    text = leader_spec.read_text("utf-8")
    assert SLOW in text
    return text.replace(SLOW, FAST)


def codes(text: str, tmp_path: Path) -> list[str]:
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    return [one.code for one in load_swarm(tmp_path / "swarm.yaml")[1]]


def test_without_an_ignore_it_is_reported(spec: str, tmp_path: Path) -> None:
    assert codes(spec, tmp_path) == ["SET001"]


@pytest.mark.parametrize(
    "line",
    [
        f"{FAST}  # swarmctl: ignore SET001 larger wheels",
        f"# swarmctl: ignore SET001 larger wheels\n  {FAST}",
        f"{FAST}  # measured. swarmctl: ignore SET001 larger wheels".replace("# measured. ", "# "),
    ],
)
def test_a_comment_on_the_line_or_above_it(spec: str, tmp_path: Path, line: str) -> None:
    assert codes(spec.replace(FAST, line), tmp_path) == []


def test_a_comment_elsewhere_ignores_nothing(spec: str, tmp_path: Path) -> None:
    text = f"# swarmctl: ignore SET001 larger wheels\n{spec}"
    assert codes(text, tmp_path) == ["SIL001", "SET001"]


@pytest.mark.parametrize("about", ["", "about: khepera3, "])
def test_an_entry_of_the_spec(spec: str, tmp_path: Path, about: str) -> None:
    text = f"{spec}\nignore:\n  - {{rule: SET001, {about}reason: larger wheels}}\n"
    assert codes(text, tmp_path) == []


def test_an_entry_about_something_else(spec: str, tmp_path: Path) -> None:
    text = f"{spec}\nignore:\n  - {{rule: SET001, about: koala, reason: larger wheels}}\n"
    assert codes(text, tmp_path) == ["SET001", "SIL001"]


@pytest.mark.parametrize(
    ("comment", "code"),
    [
        ("swarmctl: ignore SET001", "SIL003"),
        ("swarmctl: ignore SET001 --", "SIL003"),
        ("swarmctl: ignore SET999 larger wheels", "SIL002"),
        ("swarmctl: ignore REF001 comes next week", "SIL004"),
    ],
)
def test_an_invalid_ignore(spec: str, tmp_path: Path, comment: str, code: str) -> None:
    assert codes(spec.replace(FAST, f"{FAST}  # {comment}"), tmp_path) == ["SET001", code]


def test_what_the_reader_finds_in_a_robot_type_beside_the_spec(spec: str, tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    shipped = (resources.templates() / "robots/khepera3.yaml").read_text("utf-8")
    mine = f"{shipped}urdf:\n"
    (tmp_path / "robots/lab-khepera3.yaml").write_text(mine, "utf-8")
    text = spec.replace(FAST, SLOW).replace("type: khepera3", "type: lab-khepera3")
    assert codes(text, tmp_path) == ["YAML015"]
    ignore = "ignore:\n  - {rule: YAML015, reason: it comes next week}\n"
    assert codes(f"{text}\n{ignore}", tmp_path) == []
