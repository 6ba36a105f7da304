"""~/.ssh/config applies as it does for ssh, below the spec, and no command in it is ever run."""

from __future__ import annotations

import getpass
import os
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from operator import attrgetter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.cli.ssh_targets import login
from swarmctl.remote.known_hosts import KnownHosts, Line
from swarmctl.remote.openssh_files import OpenSshFileError
from swarmctl.remote.ssh_config import Login, Resolver, SshConfig
from swarmctl.remote.transport import Target
from tests.loading import load_swarm

HOME = Path("/home/anna")
PI = Login("pi", "192.168.77.11", "robot")
Read = Callable[..., tuple[Target, list[str]]]


def resolve(path: Path, login: Login, **keys: tuple[str, ...]) -> tuple[Target, list[str]]:
    """The target and the warnings under the configuration at ``path``."""
    known = KnownHosts(tuple(Line("", (name,), key) for name, pinned in keys.items() for key in pinned))
    config = SshConfig(path)
    return Resolver(config, known, "anna", HOME).target(login), list(config.warnings)


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """Resolves a login under the text of a configuration."""

    def resolved(text: str, login: Login = PI, **keys: tuple[str, ...]) -> tuple[Target, list[str]]:
        (tmp_path / "config").write_text(text)
        return resolve(tmp_path / "config", login, **keys)

    return resolved


def test_without_a_file_the_spec_decides(tmp_path: Path) -> None:
    got, warnings = resolve(tmp_path / "none", PI, pi=("t k",))
    assert got == Target("pi", "192.168.77.11", "robot", 22, ("t k",))
    assert warnings == []


def test_blocks_apply_by_name_and_by_address_and_the_first_value_wins(read: Read) -> None:
    text = """
    Host 192.168.77.*
      Port 2200
      IdentityFile ~/.ssh/lab
    Host pi
      Port = 2201
      HostName "10.8.0.11"
      IdentityFile %d/keys/%r@%h
    Host *
      User someone
      IdentityFile none
    """
    assert read(text)[0] == Target(
        "pi",
        "10.8.0.11",
        "robot",
        2200,
        identities=(HOME / ".ssh/lab", Path("/home/anna/keys/robot@10.8.0.11")),
    )


# What the spec, its `defaults.host`, and ~/.ssh/config set for a host, and what ssh is called with.
SETTINGS = [
    # spec, spec defaults, config, expected
    ("user: anna", "user: robot", "User other", ("user", "anna")),
    ("user: anna", "user: robot", "", ("user", "anna")),
    ("user: anna", "", "User other", ("user", "anna")),
    ("user: robot", "", "User other", ("user", "robot")),
    ("user: anna", "", "", ("user", "anna")),
    ("", "user: jane", "User other", ("user", "jane")),
    ("", "user: robot", "User other", ("user", "robot")),
    ("", "user: jane", "", ("user", "jane")),
    ("", "", "User other", ("user", "other")),
    ("", "", "", ("user", "robot")),
    ("port: 22", "port: 2200", "Port 2222", ("port", 22)),
    ("port: 22", "port: 2200", "", ("port", 22)),
    ("port: 22", "", "Port 2222", ("port", 22)),
    ("port: 2201", "", "Port 2222", ("port", 2201)),
    ("port: 2201", "", "", ("port", 2201)),
    ("", "port: 22", "Port 2222", ("port", 22)),
    ("", "port: 2200", "Port 2222", ("port", 2200)),
    ("", "port: 2200", "", ("port", 2200)),
    ("", "", "Port 2222", ("port", 2222)),
    ("", "", "", ("port", 22)),
    ("", "", "HostName 10.8.0.11", ("address", "10.8.0.11")),
    ("", "", "", ("address", "192.168.77.11")),
    ("", "", "IdentityFile ~/.ssh/lab", ("identities", (HOME / ".ssh/lab",))),
    ("", "", "", ("identities", ())),
    ("via: gate", "", "ProxyJump other", ("jump.host", "gate")),
    ("via: gate", "", "ProxyJump none", ("jump.host", "gate")),
    ("via: gate", "", "", ("jump.host", "gate")),
    ("", "", "ProxyJump other", ("jump.host", "other")),
    ("", "", "", ("jump", None)),
]


@pytest.mark.parametrize(("spec", "defaults", "config", "expected"), SETTINGS)
def test_the_spec_wins_and_the_config_sets_the_rest(
    tmp_path: Path, spec: str, defaults: str, config: str, expected: tuple[str, object]
) -> None:
    (tmp_path / "swarm.yaml").write_text(
        "version: 1\nname: new\nmode: leader\nleader: pi\n"
        f"defaults: {{host: {{{defaults}}}}}\n"
        f"hosts:\n  pi: {{address: 192.168.77.11, {spec}}}\n  gate: {{address: 192.168.77.9}}\n"
        "robots:\n  koala: {type: koala, host: pi}\n"
        "links:\n"
        "  - {kind: serial, host: pi, robot: koala, usb: {serial: A6}}\n"
        "  - {kind: ethernet, name: lan, hosts: [pi, gate], subnet: 192.168.77.0/24}\n"
        "control:\n  - {by: pi, of: [koala]}\n"
    )
    swarm, diagnostics = load_swarm(tmp_path / "swarm.yaml")
    assert swarm is not None, diagnostics
    (tmp_path / "config").write_text(f"Host pi\n  {config}\n")

    got, _ = resolve(tmp_path / "config", login(swarm, "pi"))

    assert attrgetter(expected[0])(got) == expected[1]


def test_a_login_without_any_user_uses_the_local_account(read: Read) -> None:
    text = "Host *\n User other\n Port 2200\n"
    assert read(text, Login("pi", "10.0.0.1", "robot", 23))[0].port == 23
    assert read(text, Login("pi", "10.0.0.1", "robot"))[0].user == "robot"
    assert read(text, Login("pi", "10.0.0.1"))[0].user == "other"
    assert read("", Login("pi", "10.0.0.1"))[0].user == "anna"


@pytest.mark.parametrize(
    ("patterns", "applies"),
    [
        ("pi", True),
        ("p?", True),
        ("*", True),
        ("* !pi", False),
        ("!pi *", False),
        ("!other *", True),
        ("[pi]", False),
    ],
)
def test_patterns(read: Read, patterns: str, applies: bool) -> None:
    assert (read(f"Host {patterns}\n Port 5\n")[0].port == 5) is applies


def test_jumps_are_nested_and_each_has_its_own_keys(read: Read) -> None:
    text = """
    Host pi
      ProxyJump outer,inner:2222
    Host inner
      HostName 10.0.0.2
      User gatekeeper
    """
    got, _ = read(text, pi=("t kp",), inner=("t ki",), outer=("t ko",))
    assert got.jump == Target(
        "inner",
        "10.0.0.2",
        "gatekeeper",
        2222,
        ("t ki",),
        jump=Target("outer", "outer", "anna", 22, ("t ko",)),
    )


def test_a_jump_host_may_itself_need_a_jump(read: Read) -> None:
    got, _ = read("Host pi\n ProxyJump b\nHost b\n ProxyJump ssh://eve@a:99\n")
    assert got.jump is not None
    assert got.jump.jump == Target("a", "a", "eve", 99)


def test_the_jump_host_of_the_spec_wins_over_the_file(read: Read) -> None:
    gate = Login("gate", "10.0.0.9", "robot")
    got, _ = read("Host pi\n ProxyJump other\n", Login("pi", "10.0.0.1", "robot", via=gate), gate=("t kg",))
    assert got.jump == Target("gate", "10.0.0.9", "robot", 22, ("t kg",))


def test_proxyjump_none_means_no_jump_host(read: Read) -> None:
    assert read("Host pi\n ProxyJump none\nHost *\n ProxyJump gate\n")[0].jump is None


def test_a_circle_of_jumps_ends_with_a_warning(read: Read) -> None:
    _, warnings = read("Host *\n ProxyJump gate\n")
    assert "form a circle" in warnings[0]


def test_commands_are_not_run_and_a_match_gives_a_warning(tmp_path: Path, read: Read) -> None:
    trap = tmp_path / "trap"
    text = f'Match exec "touch {trap}"\n Port 99\nHost pi\n ProxyCommand sh -c \'touch {trap}\n'
    got, warnings = read(text)
    assert got.port == 22
    ignored = f"`Match exec touch {trap}` is ignored; only `all` and `originalhost` are supported"
    assert warnings == [f"{tmp_path}/config:1: {ignored}"]
    assert got.proxy_command == f"sh -c 'touch {trap}"
    assert not trap.exists()


def test_of_two_proxies_the_first_counts(read: Read) -> None:
    command, jump = "ProxyCommand nc %h %p", "ProxyJump gate"
    for text, expected in (
        (f"Host other\n {command}\n", ("", None)),
        (f"Host pi\n ProxyCommand none\nHost *\n {command}\n", ("", None)),
        (f"Host pi\n {command}\nHost *\n {jump}\n", ("nc %h %p", None)),
        (f"Host pi\n {jump}\nHost *\n {command}\n", ("", "gate")),
        (f"Host pi\n ProxyJump none\nHost *\n {command}\n", ("nc %h %p", None)),
    ):
        got = read(text)[0]
        hop = got.jump
        while hop is not None and hop.jump is not None:
            hop = hop.jump
        assert (got.proxy_command, hop and hop.host) == expected, text


def test_what_only_the_program_ssh_knows_is_named(read: Read) -> None:
    text = (
        "Host pi\n CertificateFile ~/.ssh/lab-cert.pub\n GSSAPIAuthentication no\n IdentityAgent none\n"
        "Host other\n PKCS11Provider /usr/lib/token.so\n"
    )
    assert read(text)[0].ssh_only == ("CertificateFile",)
    assert read(text, Login("other", "10.0.0.1"))[0].ssh_only == ("PKCS11Provider",)


def test_match_originalhost_and_match_all_are_supported(read: Read) -> None:
    assert read("Match originalhost pi,other\n Port 5\n")[0].port == 5
    assert read("Host nobody\n Port 1\nMatch all\n Port 6\n")[0].port == 6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Host pi\n Port many\n", "config:2: Port many is not a number from 1 to 65535"),
        ("Host other\n Port 70000\n", "config:2: Port 70000 is not a number from 1 to 65535"),
        ('\nHost "pi\n', "config:2: a quotation mark is missing"),
        ("Host\n", "config:1: Host has no value"),
        ("Include config\n", "config: more than 16 nested Includes"),
        ("Include config config\n", "config: more than 16 nested Includes"),
    ],
)
def test_a_broken_line_is_an_error_with_its_place(
    tmp_path: Path, read: Read, text: str, message: str
) -> None:
    with pytest.raises(OpenSshFileError) as caught:
        read(text)
    assert str(caught.value).startswith(f"{tmp_path}/{message}")


def test_includes_are_read_and_apply_where_they_stand(tmp_path: Path) -> None:
    (tmp_path / "conf.d").mkdir()
    (tmp_path / "conf.d/a").write_text("Port 5\nHost pi\n User eve\n")
    (tmp_path / "config").write_text("Host other\n Include conf.d/*\nHost pi\n Include conf.d/a\n")
    assert resolve(tmp_path / "config", Login("pi", "10.0.0.1"))[0].user == "eve"
    assert resolve(tmp_path / "config", Login("x", "10.0.0.2"))[0].port == 22


def test_a_block_in_an_included_file_ends_with_that_file(tmp_path: Path) -> None:
    (tmp_path / "inner").write_text("Host other\n Port 5\n")
    (tmp_path / "config").write_text("Host pi\n Include inner\n User eve\n")
    assert resolve(tmp_path / "config", Login("pi", "10.0.0.1"))[0].user == "eve"


def test_an_include_of_a_pipe_is_an_error(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "config").write_text("Include pipe\n")
    with pytest.raises(OpenSshFileError, match="not a regular file"):
        resolve(tmp_path / "config", PI)


def test_bytes_that_are_not_utf8_in_a_comment_do_no_harm(tmp_path: Path) -> None:
    (tmp_path / "config").write_bytes(b"# M\xfcller\nPort 5\n")
    assert resolve(tmp_path / "config", PI)[0].port == 5


@given(st.text())
def test_no_text_is_a_crash(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = tmp_path_factory.mktemp("ssh") / "config"
    path.write_text(text, encoding="utf-8")
    with suppress(OpenSshFileError):
        resolve(path, PI)


HOSTS = ["Host pi", "Host *", "Host !pi *", "Host 10.*", "Match all", "Match originalhost pi", "  # note"]
OPTIONS = ["Port 7", "Port=8", "User eve", "HostName 10.9.9.9"]
JUMPS = ["ProxyJump gate", "ProxyJump none", "ProxyJump eve@gate:9", "ProxyCommand nc", "ProxyCommand none"]
LINES = st.lists(st.sampled_from(HOSTS + OPTIONS + JUMPS), max_size=8)


@pytest.mark.skipif(shutil.which("ssh") is None, reason="needs ssh (apt install openssh-client)")
@given(LINES)
def test_values_are_those_that_ssh_uses(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    path = tmp_path_factory.mktemp("ssh") / "config"
    path.write_text("\n".join(lines) + "\n")
    command = ["ssh", "-G", "-F", path, "pi"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    wanted = dict(line.split(" ", 1) for line in printed.splitlines() if " " in line)

    got, _ = resolve(path, Login("pi", "pi", default_user=getpass.getuser()))

    assert (got.address, str(got.port)) == (wanted["hostname"], wanted["port"])
    assert got.user == wanted["user"]
    jump = wanted.get("proxyjump", "none")
    assert (got.jump is None) == (jump == "none")
    assert got.proxy_command == wanted.get("proxycommand", "none").replace("none", "")
