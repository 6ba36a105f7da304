"""~/.ssh/config is honoured as ssh does, and nothing in it is ever run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.remote.sshconfig import Login, load, parse, resolve
from swarmctl.remote.transport import Target

HOME = Path("/home/anna")
PI = Login("pi", "192.168.77.11", "robot")


def target(text: str, login: Login = PI, **keys: tuple[str, ...]) -> Target:
    return resolve(parse(text), login, keys, local_user="anna", home=HOME).target


def test_without_a_file_the_spec_is_all() -> None:
    assert target("", pi=("k",)) == Target("pi", "192.168.77.11", "robot", 22, ("k",))


def test_blocks_count_by_name_and_by_address_and_the_first_value_wins() -> None:
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
    assert target(text) == Target(
        "pi",
        "10.8.0.11",
        "robot",
        2200,
        identities=(HOME / ".ssh/lab", Path("/home/anna/keys/robot@10.8.0.11")),
    )


def test_user_and_port_of_the_spec_go_before_the_file() -> None:
    text = "Host *\n User other\n Port 2200\n"
    assert target(text, Login("pi", "10.0.0.1", "robot", 23)).port == 23
    assert target(text, Login("pi", "10.0.0.1", "robot")).user == "robot"
    assert target(text, Login("pi", "10.0.0.1")).user == "other"
    assert target("", Login("pi", "10.0.0.1")).user == "anna"


@pytest.mark.parametrize(
    ("patterns", "counts"),
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
def test_patterns(patterns: str, counts: bool) -> None:
    assert (target(f"Host {patterns}\n Port 5\n").port == 5) is counts


def test_jumps_are_nested_and_each_has_its_own_keys() -> None:
    text = """
    Host pi
      ProxyJump outer,inner:2222
    Host inner
      HostName 10.0.0.2
      User gatekeeper
    """
    got = target(text, pi=("kp",), inner=("ki",), outer=("ko",))
    assert got.jump == Target(
        "inner", "10.0.0.2", "gatekeeper", 2222, ("ki",), jump=Target("outer", "outer", "anna", 22, ("ko",))
    )


def test_a_jump_host_may_itself_need_a_jump() -> None:
    got = target("Host pi\n ProxyJump b\nHost b\n ProxyJump ssh://eve@a:99\n")
    assert got.jump is not None
    assert got.jump.jump == Target("a", "a", "eve", 99)


def test_the_way_that_the_spec_names_goes_before_the_file() -> None:
    gate = Login("gate", "10.0.0.9", "robot")
    got = target("Host pi\n ProxyJump other\n", Login("pi", "10.0.0.1", "robot", via=gate), gate=("kg",))
    assert got.jump == Target("gate", "10.0.0.9", "robot", 22, ("kg",))


def test_proxyjump_none_means_straight() -> None:
    assert target("Host pi\n ProxyJump none\nHost *\n ProxyJump gate\n").jump is None


def test_a_circle_of_jumps_ends_with_a_warning() -> None:
    got = resolve(parse("Host *\n ProxyJump gate\n"), PI, {}, local_user="anna", home=HOME)
    assert "lead in a circle" in got.warnings[0]


def test_commands_are_never_run_but_told(tmp_path: Path) -> None:
    trap = tmp_path / "trap"
    text = f'Match exec "touch {trap}"\n Port 99\nHost pi\n ProxyCommand touch {trap}\n'
    config = parse(text, "config")
    got = resolve(config, PI, {}, local_user="anna", home=HOME)
    assert got.target.port == 22
    assert config.warnings == (
        f"config:1: `Match exec touch {trap}` is passed over; only `all` and `originalhost` are known",
    )
    assert got.warnings == ("pi: ProxyCommand in ~/.ssh/config is passed over; use ProxyJump",)
    assert not trap.exists()


def test_match_originalhost_and_match_all_are_known() -> None:
    assert target("Match originalhost pi,other\n Port 5\n").port == 5
    assert target("Host nobody\n Port 1\nMatch all\n Port 6\n").port == 6


def test_a_wrong_port_and_a_lost_quotation_mark_are_told() -> None:
    got = resolve(parse("Host pi\n Port many\n"), PI, {}, local_user="anna", home=HOME)
    assert got.target.port == 22
    assert got.warnings == ("pi: Port many in ~/.ssh/config is no port; 22 is used",)
    assert parse('Host "pi\n', "c").warnings == ("c:1: a quotation mark is missing; the line is passed over",)


def test_includes_are_read_and_count_where_they_stand(tmp_path: Path) -> None:
    (tmp_path / "conf.d").mkdir()
    (tmp_path / "conf.d/a").write_text("Port 5\nHost pi\n User eve\n")
    (tmp_path / "config").write_text("Host other\n Include conf.d/*\nHost pi\n Include conf.d/a\n")
    config = load(tmp_path / "config")
    assert resolve(config, Login("pi", "10.0.0.1"), {}, local_user="anna", home=HOME).target.user == "eve"
    assert resolve(config, Login("x", "10.0.0.2"), {}, local_user="anna", home=HOME).target.port == 22


def test_a_file_that_includes_itself_ends(tmp_path: Path) -> None:
    (tmp_path / "config").write_text("Include config\nPort 5\n")
    assert resolve(load(tmp_path / "config"), PI, {}, local_user="anna", home=HOME).target.port == 5


def test_an_absent_file_says_nothing(tmp_path: Path) -> None:
    assert load(tmp_path / "none").rules == ()


@given(st.text())
def test_no_text_is_a_crash(text: str) -> None:
    resolve(parse(text), PI, {}, local_user="anna", home=HOME)


HOSTS = ["Host pi", "Host *", "Host !pi *", "Host 10.*", "Match all", "Match originalhost pi", "  # note"]
OPTIONS = ["Port 7", "Port=8", "User eve", "HostName 10.9.9.9"]
JUMPS = ["ProxyJump gate", "ProxyJump none", "ProxyJump eve@gate:9"]
LINES = st.lists(st.sampled_from(HOSTS + OPTIONS + JUMPS), max_size=8)


@pytest.mark.skipif(shutil.which("ssh") is None, reason="needs ssh (apt install openssh-client)")
@given(LINES)
def test_it_says_what_ssh_says(tmp_path_factory: pytest.TempPathFactory, lines: list[str]) -> None:
    path = tmp_path_factory.mktemp("ssh") / "config"
    path.write_text("\n".join(lines) + "\n")
    command = ["ssh", "-G", "-F", path, "pi"]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    wanted = dict(line.split(" ", 1) for line in printed.splitlines() if " " in line)

    got = resolve(load(path), Login("pi", "pi"), {}, local_user=wanted["user"], home=HOME).target

    assert (got.address, str(got.port)) == (wanted["hostname"], wanted["port"])
    jump = wanted.get("proxyjump", "none")
    assert (got.jump is None) == (jump == "none")
