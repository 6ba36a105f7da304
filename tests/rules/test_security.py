"""Secrets are found by name and by looks, keys by their files; nothing that swarmctl prints repeats one."""

from __future__ import annotations

from pathlib import Path

import pytest

from swarmctl.cli.app import run
from swarmctl.rules.security import is_secret
from tests.loading import load_swarm

PROGRAM = """
programs:
  uplink:
    host: koala-laptop
    package: uplink
    executable: uplink.py
    params: {VALUE}
"""
KEY = "-----BEGIN OPENSSH PRIVATE KEY-----\nb3BlbnNzaC1rZXktdjEAAAAA\n-----END OPENSSH PRIVATE KEY-----\n"


@pytest.mark.parametrize(
    ("key", "value", "secret"),
    [
        ("password", "hunter2", True),
        ("password", 123456, True),
        ("mqtt_passwd", "hunter2", True),
        ("wpa_psk", "hunter2", True),
        ("authToken", "hunter2", True),
        ("API_KEY", "hunter2", True),
        ("apiKey", "hunter2", True),
        ("bluetooth_pin", "1234", True),
        ("pin", 17, False),  # a pin of the board
        ("led_pin", "17", False),
        ("tokens", 512, False),
        ("max_token_length", 512, False),
        ("token", 5, False),
        ("use_password", True, False),
        ("password", "", False),
        ("password", "$MQTT_PASSWORD", False),
        ("password", "/etc/uplink/password", False),
        ("password_file", "uplink.txt", False),
        ("token_topic", "tokens", False),
        ("key", "left", False),
        ("monkey", "hunter2", False),
        ("keyboard", "us", False),
    ],
)
def test_a_secret_is_known_by_the_name_of_its_key(key: str, value: object, secret: bool) -> None:
    assert is_secret(key, value) is secret


def found_with(value: str, leader_spec: Path, tmp_path: Path) -> list[str]:
    text = leader_spec.read_text("utf-8") + PROGRAM.replace("{VALUE}", value)
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    return [one.code for one in load_swarm(tmp_path / "swarm.yaml")[1] if one.code.startswith("SEC")]


@pytest.mark.parametrize(
    ("value", "codes"),
    [
        ("note: AKIAIOSFODNN7EXAMPLE", ["SEC002"]),
        (f"note: ghp_{'a' * 36}", ["SEC002"]),
        (f"note: github_pat_{'A1' * 20}", ["SEC002"]),
        (f"note: glpat-{'x' * 20}", ["SEC002"]),
        ("note: xoxb-123456789012-abcdef", ["SEC002"]),
        ('note: "https://robot:hunter2@broker/"', ["SEC002"]),
        ('note: "udp://0.0.0.0:14540@127.0.0.1"', []),
        ('password: "https://robot:hunter2@broker/"', ["SEC001"]),  # reported once
        ('note: "https://broker:8080/@robot"', []),
        ('note: "mqtt://robot@broker"', []),
        ('note: "mqtt://robot:${PASSWORD}@broker"', []),
        ('note: "Authorization: Bearer {secret}"', []),
        ("note: AKIA", []),
        ("note: -----BEGIN PUBLIC KEY-----", []),
    ],
)
def test_a_secret_is_known_by_its_looks(
    value: str, codes: list[str], leader_spec: Path, tmp_path: Path
) -> None:
    assert found_with(f"{{{value}}}", leader_spec, tmp_path) == codes


@pytest.mark.parametrize("form", ["human", "concise", "json", "github", "gitlab", "sarif", "junit"])
@pytest.mark.parametrize(
    "value",
    [
        "{password: hunter2}",
        '{broker: "mqtt://robot:hunter2@broker"}',
        '\n      password: "not on one line,\n      hunter2"',
    ],
)
def test_no_format_repeats_a_secret(
    value: str, form: str, leader_spec: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = leader_spec.read_text("utf-8") + PROGRAM.replace("{VALUE}", value)
    (tmp_path / "swarm.yaml").write_text(text, "utf-8")
    run(["validate", str(tmp_path / "swarm.yaml"), "--format", form])
    printed = capsys.readouterr()
    assert "SEC00" in printed.out + printed.err
    assert "hunter2" not in printed.out + printed.err


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("id_ed25519", KEY, True),
        ("robots.pem", KEY, True),
        ("ssh/id_rsa", KEY, True),
        ("keys/lab.key", KEY, True),
        ("id_ed25519.pub", "ssh-ed25519 AAAA robot@lab\n", False),
        ("lab.pem", "-----BEGIN CERTIFICATE-----\n", False),
        ("deep/er/id_rsa", KEY, False),
    ],
)
def test_a_private_key_beside_the_spec(
    name: str, text: str, found: bool, leader_spec: Path, tmp_path: Path
) -> None:
    (tmp_path / "swarm.yaml").write_bytes(leader_spec.read_bytes())
    (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / name).write_text(text, "utf-8")
    _, problems = load_swarm(tmp_path / "swarm.yaml")
    assert [(one.code, f"`{name}`" in one.message) for one in problems] == (
        [("SEC003", True)] if found else []
    )


def test_a_folder_that_cannot_be_listed_holds_no_keys(leader_spec: Path, tmp_path: Path) -> None:
    (tmp_path / "swarm.yaml").write_bytes(leader_spec.read_bytes())
    (tmp_path / "keys").write_text("not a folder", "utf-8")
    (tmp_path / "id_rsa").mkdir()
    (tmp_path / "id_dsa").symlink_to("/dev/zero")
    assert load_swarm(tmp_path / "swarm.yaml")[1] == ()
