"""The command line as a person or a script meets it: exit codes, streams, and never a traceback."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from swarmctl import __version__, rulebook
from swarmctl.cli import exit_codes
from swarmctl.cli.app import Verbs, run
from swarmctl.cli.lazy_verbs import Verb
from tests import in_process
from tests.rules.specs import BROKEN, spec

PROGRAM = Path(sys.executable).with_name("swarmctl")
VERBS = [verb.name for verb in Verbs.verbs]


OURS = ("FORCE_COLOR", "SWARMCTL_DEBUG")


def swarmctl(*arguments: str, **env: str) -> subprocess.CompletedProcess[str]:
    return in_process.swarmctl(*arguments, env={**dict.fromkeys(OURS), **env})


def started(*arguments: str, **env: str) -> subprocess.CompletedProcess[str]:
    """What a process of its own prints and returns."""
    environment = {key: value for key, value in os.environ.items() if key not in OURS}
    return subprocess.run(
        [str(PROGRAM), *arguments], env=environment | env, capture_output=True, text=True, check=False
    )


def test_version() -> None:
    for option in ("--version", "-V"):
        ran = started(option)
        assert (ran.returncode, ran.stdout, ran.stderr) == (exit_codes.OK, f"swarmctl {__version__}\n", "")


def test_no_arguments_show_the_help() -> None:
    ran = started()
    assert ran.returncode == exit_codes.USAGE
    assert "Usage: swarmctl" in ran.stdout + ran.stderr


def test_the_help_has_the_verbs_in_groups() -> None:
    lines = swarmctl("--help", COLUMNS="80").stdout.splitlines()
    sections = [one[:-1] for one in lines if one.endswith(":") and not one.startswith(" ")]
    assert sections == ["Options", *Verbs.groups]
    begun = lines[lines.index(f"{sections[1]}:") :]
    assert [one.split()[0] for one in begun if one.startswith("  ") and one[2] != " "][: len(VERBS)] == VERBS
    assert max(map(len, lines)) <= 80


@pytest.mark.parametrize("verb", Verbs.verbs, ids=VERBS)
def test_the_example_of_a_verb_is_a_command(verb: Verb) -> None:
    words = shlex.split(verb.example)
    assert words[0] == verb.name
    assert f"Example: swarmctl {verb.example}" in " ".join(swarmctl(words[0], "--help").stdout.split())
    end = words.index("--") if "--" in words else len(words)
    ran = swarmctl(*words[:end], "--help", *words[end:])
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")


@pytest.mark.parametrize("verb", ["", *VERBS])
def test_help(verb: str) -> None:
    ran = swarmctl(*filter(None, (verb, "--help")))
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    assert ran.stdout.startswith(f"Usage: swarmctl {verb}".rstrip())


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["validat", "x.yaml"], "No such command 'validat'. Did you mean 'validate'?"),
        (["mode", "infr"], "No such command 'infr'. Did you mean 'infer'?"),
        (["validate"], "missing argument SPEC"),
        (["validate", "x.yaml", "--jsn"], "No such option: --jsn"),
        (["render", "x.yaml"], "Missing option '--out'"),
        (["schema", "robots"], "is not one of 'swarm', 'robot-type'"),
    ],
)
def test_wrong_usage(arguments: list[str], expected: str) -> None:
    ran = swarmctl(*arguments)
    assert (ran.returncode, ran.stdout) == (exit_codes.USAGE, "")
    assert expected in ran.stderr
    assert "--help" in ran.stderr


@pytest.mark.parametrize("columns", ["0", "00", "1"])
def test_findings_are_shown_in_any_width(columns: str) -> None:
    ran = swarmctl("validate", str(spec(BROKEN, "bad-mode")), COLUMNS=columns)
    assert ran.returncode == exit_codes.ERROR
    assert "error[SPEC003]" in ran.stderr


def test_closed_streams_are_no_error() -> None:
    for closed, stream in ((">&-", "stderr"), ("2>&-", "stdout")):
        command = f"exec '{PROGRAM}' rules {closed}"
        ran = subprocess.run(["sh", "-c", command], capture_output=True, text=True, check=False)
        assert ran.returncode == exit_codes.OK
        assert "AttributeError" not in ran.stderr
        assert ("NET001" in ran.stdout) == (stream == "stdout")


def test_a_valid_spec(leader_spec: Path) -> None:
    ran = swarmctl("validate", str(leader_spec))
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    assert ran.stdout == f"{leader_spec}: swarm `newswarm` is valid: 3 robots on 3 hosts, mode leader\n"


@pytest.mark.parametrize("name", ["many-at-once", "syntax-tab", "empty", "not-utf8", "control-character"])
def test_json_is_the_only_thing_on_stdout(name: str) -> None:
    ran = swarmctl("validate", "--json", str(spec(BROKEN, name)))
    assert (ran.returncode, ran.stderr) == (exit_codes.ERROR, "")
    report = json.loads(ran.stdout)
    assert report["valid"] is False
    assert all(one["span"]["line"] >= 1 and one["severity"] == "error" for one in report["diagnostics"])


def test_json_of_a_valid_spec(leader_spec: Path) -> None:
    ran = swarmctl("validate", "--json", str(leader_spec))
    assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    report = json.loads(ran.stdout)
    assert (report["v"], report["valid"], report["diagnostics"]) == (1, True, [])


def test_no_colour_where_nobody_looks() -> None:
    ran = swarmctl("validate", str(spec(BROKEN, "bad-mode")))
    assert ran.returncode == exit_codes.ERROR
    assert "\x1b" not in ran.stderr


def test_a_bug_is_one_line_and_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import swarmctl.linter.runner as runner\n"
        "def broken(*path, **named): raise RuntimeError('boom')\n"
        "runner.check_files = broken\n"
    )
    ran = started("validate", "x.yaml", PYTHONPATH=str(tmp_path))
    assert (ran.returncode, ran.stdout) == (exit_codes.ERROR, "")
    assert ran.stderr.startswith("error: RuntimeError: boom\n")
    assert "Traceback" not in ran.stderr
    assert "Traceback" in started("validate", "x.yaml", PYTHONPATH=str(tmp_path), SWARMCTL_DEBUG="1").stderr


def test_ctrl_c_is_one_line_and_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Wherever a verb is: here as it reads the rules."""

    def interrupted() -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(rulebook, "rulebook", interrupted)
    assert run(["rules"]) == exit_codes.INTERRUPTED
    assert capsys.readouterr() == ("", "interrupted\n")


@pytest.mark.parametrize("module", ["swarmctl.streams", "swarmctl.cli.app", "typer", "typing"])
def test_ctrl_c_during_an_import_is_one_line(module: str) -> None:
    script = f"""
import sys
class Interrupt:
    def find_spec(name, *_):
        if name == {module!r}:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupt)
sys.modules.pop({module!r}, None)
from swarmctl.__main__ import main
sys.exit(main())
"""
    ran = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout, ran.stderr) == (exit_codes.INTERRUPTED, "", "interrupted\n")


def test_a_reader_that_leaves_is_no_error() -> None:
    ran = subprocess.run(
        ["sh", "-c", f"{PROGRAM} schema | head -c 1 >/dev/null"], capture_output=True, text=True, check=False
    )
    assert (ran.returncode, ran.stderr) == (0, "")
