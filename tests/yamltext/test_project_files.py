"""A spec draws in its own files and no others: nothing special, no link elsewhere, one budget for all."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.yamltext.files import MAX_BYTES, MAX_FILES, MAX_NODES
from tests import ROOT, in_process
from tests.loading import load_checked
from tests.sizes import some_of
from tests.timing import PATIENCE
from tests.yamltext.hostile_inputs import EXAMPLE, OWN_TYPE

SECRET = "AKIA-not-for-the-log"
CODEC = "class SnailCodec:\n    def __init__(self, options): ...\n    def speed(self, left, right): ...\n"
KINDS = ("spec", "overlay", "include", "type", "codec", "folder", "key")


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a spec that uses everything a spec can draw in, and beside it a folder with a secret."""
    (tmp_path / "elsewhere").mkdir()
    for name in ("secret.yaml", "secret.py", "secret", "id_rsa"):
        (tmp_path / "elsewhere" / name).write_text(f"-----BEGIN PRIVATE KEY-----\n{SECRET}: [{SECRET}\n")
    folder = tmp_path / "lab"
    (folder / "robots").mkdir(parents=True)
    (folder / "swarm.yaml").write_text(f"include: more.yaml\n{EXAMPLE}")
    (folder / "more.yaml").write_text("programs: {}\n")
    (folder / "over.yaml").write_text("{}\n")
    (folder / "robots/snail.yaml").write_bytes(OWN_TYPE)
    (folder / "robots/snail.py").write_text(CODEC)
    monkeypatch.chdir(folder)
    monkeypatch.setenv("SECRET", SECRET)
    return folder


def validated(*arguments: str) -> subprocess.CompletedProcess[str]:
    return in_process.swarmctl("validate", *arguments)


IN_EVERY_FORMAT = """
from swarmctl.cli.app import run
arguments = ["validate", "swarm.yaml", "-f", "over.yaml", "--format"]
print([run([*arguments, form]) for form in ("human", "json", "sarif")])
"""


def validated_in_every_format(*, own_process: bool) -> str:
    """What ``validate`` prints in three formats; it finds an error in each."""
    if own_process:  # its environment has the secret
        ran = subprocess.run(
            [sys.executable, "-c", IN_EVERY_FORMAT],
            capture_output=True, text=True, check=True, timeout=PATIENCE,
        )  # fmt: skip
        assert ran.stdout.endswith(f"{[exit_codes.ERROR] * 3}\n")
        return ran.stdout + ran.stderr
    runs = [
        validated("swarm.yaml", "-f", "over.yaml", "--format", form) for form in ("human", "json", "sarif")
    ]
    assert [ran.returncode for ran in runs] == [exit_codes.ERROR] * 3
    return "".join(ran.stdout + ran.stderr for ran in runs)


PLACES = {
    "spec": "swarm.yaml", "overlay": "over.yaml", "include": "more.yaml", "type": "robots/snail.yaml",
    "codec": "robots/snail.py", "folder": "robots", "key": "id_rsa", "keys": "keys",
}  # fmt: skip


def replaced(lab: Path, place: str, target: str) -> None:
    path = lab / PLACES[place]
    if path.is_dir():
        path.rename(lab / "gone")
    path.unlink(missing_ok=True)
    path.symlink_to(target.replace("..", str(lab.parent)))


def test_the_spec_is_fine_before(lab: Path) -> None:
    assert load_checked(Path("swarm.yaml"), Path("over.yaml"))[1] == ()


@pytest.mark.parametrize("place", ["spec", "overlay", "include", "type", "codec"])
@pytest.mark.parametrize(
    "target",
    ["/proc/self/environ", "../elsewhere/secret.yaml", "../elsewhere/secret.py", "/etc/passwd", ".env"],
)
def test_no_byte_of_another_file_is_printed(place: str, target: str, lab: Path) -> None:
    (lab / ".env").write_text(f"TOKEN={SECRET}\n")
    (lab / "robots/.env").write_text(f"TOKEN={SECRET}\n")
    replaced(lab, place, target)
    printed = validated_in_every_format(own_process=target == "/proc/self/environ")
    assert printed.count("INC002" if place == "include" else "FILE004") >= 3
    assert SECRET not in printed
    assert "root:" not in printed
    assert "Traceback" not in printed


@pytest.mark.parametrize(
    ("place", "target"), [("folder", "/etc"), ("folder", "../elsewhere"), ("folder", ".git")]
)
def test_a_folder_of_types_elsewhere_is_not_looked_into(place: str, target: str, lab: Path) -> None:
    (lab / ".git").mkdir()
    (lab / ".git/x.yaml").write_text(SECRET)
    replaced(lab, place, target)
    ran = validated("swarm.yaml")
    assert "error[FILE004]: `robots` is a link" in ran.stderr
    assert SECRET not in ran.stderr
    assert "secret" not in ran.stderr


def test_hidden_files_and_others_than_yaml_are_not_included(lab: Path) -> None:
    (lab / ".git").mkdir()
    for name in (".git/config", "token", "token.json", ".env.yaml"):
        (lab / name).write_text(SECRET)
        (lab / "swarm.yaml").write_text(f"include: {name}\n{EXAMPLE}")
        ran = validated("swarm.yaml")
        assert "error[INC002]" in ran.stderr
        assert SECRET not in ran.stderr


def test_private_keys_elsewhere_are_not_looked_for(lab: Path) -> None:
    replaced(lab, "keys", "../elsewhere")
    replaced(lab, "key", "../elsewhere/id_rsa")
    assert "id_rsa" not in validated("swarm.yaml").stderr
    (lab / "id_rsa").unlink()
    (lab / "id_rsa").write_text("-----BEGIN PRIVATE KEY-----\n")
    assert "warning[SEC003]: the file `id_rsa`" in validated("swarm.yaml").stderr


def test_links_within_the_folder_are_fine(lab: Path) -> None:
    (lab / "robots/slug.yaml").symlink_to("../common/slug.yaml")
    (lab / "common").mkdir()
    (lab / "robots/snail.yaml").rename(lab / "common/slug.yaml")
    (lab / "robots/snail.py").rename(lab / "robots/slug.py")
    (lab / "swarm.yaml").rename(lab / "common/spec.yaml")
    (lab / "swarm.yaml").symlink_to("common/spec.yaml")
    document, found = load_checked(Path("swarm.yaml"))
    assert found == ()
    assert document is not None
    assert "slug" in document.types


def test_the_folder_itself_may_be_a_link(lab: Path) -> None:
    (lab.parent / "here").symlink_to("lab")
    assert load_checked(lab.parent / "here/swarm.yaml")[1] == ()


def fifo(path: Path) -> None:
    os.mkfifo(path)


def bound(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(path.name)
    Path(path.name).rename(path)


@pytest.mark.parametrize(
    "place", some_of(["spec", "overlay", "include", "type", "codec", "key"], ["spec", "codec", "key"])
)
@pytest.mark.parametrize("made", [fifo, bound], ids=["pipe", "socket"])
def test_what_is_no_file_is_not_opened(place: str, made: Callable[[Path], None], lab: Path) -> None:
    (lab / PLACES[place]).unlink(missing_ok=True)
    made(lab / PLACES[place])
    ran = subprocess.run(  # of its own, for opening a pipe waits
        [sys.executable, "-m", "swarmctl", "validate", "swarm.yaml", "-f", "over.yaml"],
        capture_output=True, text=True, check=False, timeout=PATIENCE,
    )  # fmt: skip
    if place == "key":
        assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
    else:
        assert ran.returncode == exit_codes.ERROR
        assert "a device or a pipe, not a file" in ran.stderr


def test_files_of_the_kernel_are_no_specs(lab: Path) -> None:
    for path in ("/proc/self/environ", "/sys/kernel/uevent_seqnum"):
        ran = validated(path)
        assert f"error[FILE001]: cannot read `{path}`: files of /proc and /sys" in ran.stderr
    assert validated("/proc/self/cwd/swarm.yaml").returncode == exit_codes.OK


def test_a_spec_may_come_through_a_pipe(lab: Path) -> None:
    command = f"'{sys.executable}' -m swarmctl validate"
    for line in (f"{command} <(cat swarm.yaml)", f"cat swarm.yaml | {command} /dev/stdin"):
        alone = line.replace("cat swarm.yaml", f"cat '{ROOT}/examples/paper-leader/swarm.yaml'")
        ran = subprocess.run(
            ["bash", "-c", alone], capture_output=True, text=True, check=False, timeout=PATIENCE
        )
        assert (ran.returncode, ran.stderr) == (exit_codes.OK, "")
        ran = subprocess.run(
            ["bash", "-c", line], capture_output=True, text=True, check=False, timeout=PATIENCE
        )
        assert "error[INC002]: `more.yaml` lies outside the spec's folder" in ran.stderr
        assert "1 | include: more.yaml" in ran.stderr
    ran = subprocess.run(
        ["bash", "-c", f"{command} /dev/stdin < more.yaml"], capture_output=True, text=True, check=False
    )
    assert "SPEC002" in ran.stderr


def test_a_pipe_without_end_is_left(lab: Path) -> None:
    line = f"cat /dev/zero | '{sys.executable}' -m swarmctl validate /dev/stdin"
    ran = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert "error[FILE002]: `/dev/stdin` is larger than 4 MiB" in ran.stderr


def test_a_pipe_that_stays_open_is_left(lab: Path) -> None:
    code = "from pathlib import Path; import swarmctl.yamltext.files as files; files.MAX_SECONDS = 0.2"
    code += "; files.content(Path('/dev/stdin'))"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as ran:
        assert ran.stderr is not None
        assert "did not close it within 0.2 s" in ran.stderr.read()


@pytest.mark.parametrize(
    ("files", "code"),
    [
        ({f"robots/t{number}.yaml": "# x\n" for number in range(MAX_FILES)}, "FILE002"),
        ({f"robots/t{number}.yaml": "# " + "x" * (MAX_BYTES // 2) for number in range(2)}, "FILE002"),
        ({f"robots/t{number}.yaml": f"[{'a,' * (MAX_NODES // 2)}]" for number in range(2)}, "YAML014"),
    ],
    ids=["files", "bytes", "nodes"],
)
def test_types_and_spec_share_one_budget(files: Mapping[str, str], code: str, lab: Path) -> None:
    for name, text in files.items():
        (lab / name).write_text(text)
    found = [one.code for one in load_checked(Path("swarm.yaml"))[1]]
    assert found.count(code) == 1


@pytest.mark.parametrize(
    ("file", "help_"),
    [
        ("robots/slug.yml", "rename it to `robots/slug.yaml`"),
        ("robots/Slug.yaml", "rename it to `robots/slug.yaml`"),
        ("robots/slug.YAML", "rename it to `robots/slug.yaml`"),
        ("Robots/slug.yaml", "rename it to `robots/slug.yaml`"),
        ("robot/slug.yaml", "rename it to `robots/slug.yaml`"),
    ],
)
def test_a_type_where_nothing_reads_it_is_named(file: str, help_: str, lab: Path) -> None:
    (lab / file).parent.mkdir(exist_ok=True)
    (lab / "robots/snail.py").rename(lab / "robots/slug.py")
    (lab / "robots/snail.yaml").rename(lab / file)
    warned = file.startswith("robots/")
    assert ("warning[FILE005]" in validated("swarm.yaml").stderr) is warned
    (lab / "swarm.yaml").write_text(EXAMPLE.replace("type: koala", "type: slug"))
    ran = validated("swarm.yaml")
    assert "error[REF001]: unknown robot type `slug`" in ran.stderr
    assert f"= help: `{file}` is not read; {help_}" in ran.stderr


def test_a_name_that_no_spec_can_write_is_reported(lab: Path) -> None:
    (lab / "robots/snail.yaml").rename(lab / "robots/my snail.yaml")
    ran = validated("swarm.yaml")
    assert "warning[FILE005]: `robots/my snail.yaml` is not read as a robot type" in ran.stderr
    assert "give it a name of lower-case letters" in ran.stderr


def test_an_included_file_with_another_ending_is_no_type(lab: Path) -> None:
    (lab / "more.yaml").rename(lab / "robots/more.yml")
    (lab / "swarm.yaml").write_text(f"include: robots/more.yml\n{EXAMPLE}")
    assert load_checked(Path("swarm.yaml"))[1] == ()


def test_known_hosts_elsewhere_are_not_read(lab: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (lab / "swarm.known_hosts").symlink_to("/proc/self/environ")
    assert run(["plan", "swarm.yaml"]) == exit_codes.ERROR
    printed = capsys.readouterr().err
    assert "a link out of its folder" in printed
    assert SECRET not in printed
