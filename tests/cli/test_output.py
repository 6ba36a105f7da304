"""``validate`` as CI, a pipe or a terminal meets it: formats, files, colour, width, silence."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import Verbs, run
from swarmctl.cli.finding_output import Format
from tests import ROOT, in_process
from tests.sizes import some_of

BROKEN = ROOT / "tests/rules/broken/files"
PROGRAM = str(Path(sys.executable).with_name("swarmctl"))
WRONG = "SPEC003-bad-mode.yaml"
EXAMPLE = str(ROOT / "examples/paper-leader/swarm.yaml")
Ran = subprocess.CompletedProcess[str]


OURS = ("NO_COLOR", "FORCE_COLOR", "TERM", "COLUMNS", "LINES", "PYTHONIOENCODING")


def environment(**env: str) -> dict[str, str]:
    return {key: value for key, value in os.environ.items() if key not in OURS} | env


@pytest.fixture
def validate() -> Callable[..., Ran]:
    def ran(*arguments: str, cwd: Path = BROKEN, **env: str) -> Ran:
        return in_process.swarmctl("validate", *arguments, cwd=cwd, env={**dict.fromkeys(OURS), **env})

    return ran


@pytest.fixture
def warned(tmp_path: Path, leader_spec: Path) -> Path:
    """A spec that is right but for a warning."""
    spec = tmp_path / "warned.yaml"
    text = leader_spec.read_text("utf-8")
    fast = "host: koala-laptop, settings: {limits: {linear: 9.0}}}"
    spec.write_text(text.replace("type: koala, host: koala-laptop}", f"type: koala, {fast}"), "utf-8")
    return spec


def on_terminal(*arguments: str, columns: int = 80, **env: str) -> str:
    """What ``validate`` shows on a terminal of so many columns."""
    return shown([PROGRAM, "validate", *arguments], **{"TERM": "xterm", "COLUMNS": str(columns)} | env)


def shown(argv: Sequence[str], **env: str) -> str:
    """What a command shows on a terminal."""
    mine, theirs = pty.openpty()
    with subprocess.Popen(argv, cwd=BROKEN, stdout=theirs, stderr=theirs, env=environment(**env)):
        os.close(theirs)
        text = b""
        try:
            while more := os.read(mine, 4096):
                text += more
        except OSError:  # the other side is closed
            pass
    os.close(mine)
    return text.decode("utf-8").replace("\r\n", "\n")


def test_github_is_the_format_in_actions(validate: Callable[..., Ran], tmp_path: Path) -> None:
    page = tmp_path / "summary.md"
    page.write_text("before\n")
    ran = validate(WRONG, GITHUB_ACTIONS="true", GITHUB_STEP_SUMMARY=str(page))
    assert ran.returncode == exit_codes.ERROR
    assert ran.stdout.startswith("::error title=")
    assert page.read_text().startswith(
        "before\n### swarmctl validate: 1 error in 1 spec (1 fixable with validate --fix)\n"
    )
    explicit = validate(WRONG, "--format", "human", GITHUB_ACTIONS="true")
    assert (explicit.stdout, explicit.stderr.startswith("error[")) == ("", True)


def test_a_summary_that_cannot_be_written_spoils_nothing(validate: Callable[..., Ran]) -> None:
    ran = validate(WRONG, GITHUB_ACTIONS="true", GITHUB_STEP_SUMMARY="/nowhere/summary.md")
    assert ran.returncode == exit_codes.ERROR
    assert "::error" in ran.stdout
    assert "warning: the job summary cannot be written" in ran.stderr


@pytest.mark.parametrize("form", Format)
def test_a_file_gets_what_stdout_would_get(
    form: Format, validate: Callable[..., Ran], tmp_path: Path
) -> None:
    file = tmp_path / "found"
    printed = validate(WRONG, "--format", form.value)
    written = validate(WRONG, "--format", form.value, "--output", str(file))
    expected = printed.stderr if form is Format.HUMAN else printed.stdout
    assert (file.read_text("utf-8"), written.stdout) == (expected, "")
    assert written.stderr == "1 error in 1 spec (1 fixable with validate --fix)\n"
    assert written.returncode == exit_codes.ERROR


def test_a_file_that_cannot_be_written(validate: Callable[..., Ran]) -> None:
    ran = validate(WRONG, "--output", "/nowhere/found.txt")
    assert ran.returncode == exit_codes.ERROR
    assert ran.stderr.startswith("error: cannot write /nowhere/found.txt: No such file or directory\n")


@pytest.mark.parametrize("form", Format)
def test_quiet_prints_nothing(form: Format, validate: Callable[..., Ran], leader_spec: Path) -> None:
    for spec, code in ((WRONG, exit_codes.ERROR), (str(leader_spec), exit_codes.OK)):
        ran = validate(spec, "-q", "--format", form.value)
        assert (ran.returncode, ran.stdout, ran.stderr) == (code, "", "")


def test_strict_lets_a_warning_fail(validate: Callable[..., Ran], warned: Path) -> None:
    kind = validate(str(warned))
    assert kind.returncode == exit_codes.OK
    assert "is valid (1 warning)" in kind.stdout
    strict = validate(str(warned), "--strict")
    assert (strict.returncode, strict.stdout) == (exit_codes.ERROR, "")
    assert strict.stderr.endswith(f"1 warning in {warned}, and --strict allows none\n")
    assert json.loads(validate(str(warned), "--strict", "--json").stdout)["valid"] is False


def test_json_and_another_format_exclude_each_other(validate: Callable[..., Ran]) -> None:
    ran = validate(WRONG, "--json", "--format", "sarif")
    assert (ran.returncode, ran.stdout) == (exit_codes.USAGE, "")
    assert "exclude each other" in ran.stderr


def test_sarif_contains_the_rules_of_its_findings(validate: Callable[..., Ran]) -> None:
    (run,) = json.loads(validate("SPEC001-many-at-once.yaml", "--format", "sarif").stdout)["runs"]
    for result in run["results"]:
        rule = run["tool"]["driver"]["rules"][result["ruleIndex"]]
        assert rule["id"] == result["ruleId"]
        assert rule["shortDescription"]["text"]


@pytest.mark.parametrize("variable", ["GITHUB_WORKSPACE", "CI_PROJECT_DIR"])
def test_paths_in_ci_are_those_of_the_repository(variable: str, validate: Callable[..., Ran]) -> None:
    def path(**env: str) -> str:
        (issue,) = json.loads(validate(str(BROKEN / WRONG), "--format", "gitlab", **env).stdout)
        return str(issue["location"]["path"])

    assert path() == WRONG
    assert path(**{variable: str(BROKEN.parent)}) == f"files/{WRONG}"
    assert path(**{variable: "/elsewhere"}) == WRONG


@pytest.mark.parametrize(
    ("arguments", "env", "coloured"),
    [
        ((), {}, True),
        ((), {"NO_COLOR": "1"}, False),
        ((), {"NO_COLOR": ""}, True),
        ((), {"TERM": "dumb"}, False),
        (("--color", "never"), {"FORCE_COLOR": "1"}, False),
        (("--color", "always"), {"NO_COLOR": "1", "TERM": "dumb"}, True),
    ],
)
def test_colour_on_a_terminal(arguments: tuple[str, ...], env: dict[str, str], coloured: bool) -> None:
    text = on_terminal(WRONG, *arguments, **env)
    assert ("\x1b[1;31m" in text) is ("\x1b" in text) is coloured


@pytest.mark.parametrize(
    ("arguments", "env", "coloured"),
    [
        ((), {}, False),
        ((), {"FORCE_COLOR": "1"}, True),
        ((), {"FORCE_COLOR": "1", "NO_COLOR": "1"}, False),
        (("--color", "always"), {}, True),
        (("--color", "always", "--format", "concise"), {}, False),
    ],
)
def test_colour_in_a_pipe(
    arguments: tuple[str, ...], env: dict[str, str], coloured: bool, validate: Callable[..., Ran]
) -> None:
    ran = validate(WRONG, *arguments, **env)
    text = ran.stdout + ran.stderr
    assert ("\x1b[1;31m" in text) is ("\x1b" in text) is coloured


def test_colour_is_chosen_for_every_verb() -> None:
    ran = in_process.swarmctl(
        "--color", "always", "render", WRONG, "--out", "x", cwd=BROKEN, env=dict.fromkeys(OURS)
    )
    assert "\x1b[" in ran.stderr


def test_a_narrow_terminal_cuts_the_line_around_the_place(tmp_path: Path, leader_spec: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    padding = f"user: robot,{' ' * 60}computer: lapptop"
    spec.write_text(leader_spec.read_text("utf-8").replace("user: robot, computer: laptop", padding), "utf-8")
    rows = on_terminal(str(spec), columns=40, NO_COLOR="1").splitlines()
    number = next(n for n, row in enumerate(rows) if re.match(r"\d+ \| ", row))
    assert len(rows[number]) <= 40
    start = rows[number + 1].index("^")
    assert rows[number][start:].startswith("lapptop")


def test_a_pipe_gets_whole_lines(validate: Callable[..., Ran], tmp_path: Path, leader_spec: Path) -> None:
    spec = tmp_path / f"{'long' * 50}.yaml"
    spec.write_text(leader_spec.read_text("utf-8"), "utf-8")
    assert validate(str(spec), COLUMNS="40").stdout.count("\n") == 1


def test_a_letter_that_the_output_does_not_know_is_no_error(tmp_path: Path, leader_spec: Path) -> None:
    spec = tmp_path / "swärm.yaml"
    spec.write_text(leader_spec.read_text("utf-8"), "utf-8")
    ran = subprocess.run(  # of its own, whose streams are made for this encoding
        [PROGRAM, "validate", str(spec)], env=environment(PYTHONIOENCODING="ascii"), capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    assert "sw\\xe4rm.yaml: swarm `newswarm` is valid" in ran.stdout


def test_every_help_names_the_exit_codes(root: Path) -> None:
    for verb in Verbs.verbs:
        command = verb.load()
        for one in getattr(command, "commands", {"": command}).values():
            assert one.epilog.startswith("Exit codes: 0 success")
    table = re.findall(r"^\| (\d+) \| (.+) \|$", (root / "docs/checking.md").read_text("utf-8"), re.MULTILINE)
    assert {int(code): meaning.replace("`", "") for code, meaning in table} == exit_codes.MEANING


PRINTING = [
    ("validate", WRONG), ("validate", EXAMPLE), ("validate", WRONG, "--json"), ("graph", EXAMPLE),
    ("--help",),
]  # fmt: skip


@pytest.mark.parametrize("arguments", some_of(PRINTING, PRINTING[:2]), ids=" ".join)
def test_an_output_that_takes_nothing(arguments: tuple[str, ...]) -> None:
    def ran(redirected: str) -> tuple[int, str]:
        line = f"set -o pipefail; '{PROGRAM}' {' '.join(arguments)} {redirected}"
        done = subprocess.run(
            ["bash", "-c", line], cwd=BROKEN, env=environment(), capture_output=True, text=True, check=False
        )
        assert "Traceback" not in done.stderr
        assert "bug in swarmctl" not in done.stderr
        assert "Exception ignored" not in done.stderr
        return done.returncode, done.stderr

    code, errors = ran("")
    assert ran(">&-") == ran("| true") == (code, errors)
    assert ran(">&- 2>&-") == (code, "")
    on_stderr = arguments == ("validate", WRONG)
    lost = "" if on_stderr else "error: cannot write to stdout: No space left on device\n"
    assert ran(">/dev/full") == (code or exit_codes.ERROR, errors + lost)


FINDING_AND_TABLE = """
import sys
from swarmctl.cli.app import run
run(["validate", sys.argv[1]])
run(["driver", "list"])
"""


@pytest.mark.parametrize(
    ("columns", "term"),
    [
        *((columns, "xterm") for columns in ("0", "1", "-3", "junk", "9" * 30, "")),
        *(("0", term) for term in ("dumb", "")),
    ],
)
def test_no_width_hides_a_finding_or_a_table(columns: str, term: str) -> None:
    text = shown([sys.executable, "-c", FINDING_AND_TABLE, WRONG], COLUMNS=columns, TERM=term, NO_COLOR="1")
    finding, _, table = text.partition("^^^")
    assert finding.startswith("error[SPEC003]: ")
    assert "koala" in table


@pytest.mark.parametrize(
    "verb",
    [("plan", "--offline"), ("render", "--out", "out"), ("spec",), ("status",), ("graph",),
     ("graph", "--format", "json")],
    ids=" ".join,
)  # fmt: skip
def test_a_wrong_spec_is_json_as_well(
    verb: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "swarm.yaml").write_text("version: 1\n")
    words = verb if "json" in verb else (*verb, "--json")
    assert run([words[0], "swarm.yaml", *words[1:]]) == exit_codes.ERROR
    shown = capsys.readouterr()
    document = json.loads(shown.out)
    assert (document["v"], document["valid"]) == (1, False)
    assert {one["code"] for one in document["diagnostics"]} == set(re.findall(r"error\[(\w+)\]", shown.err))
