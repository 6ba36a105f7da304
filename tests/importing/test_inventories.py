"""Ansible inventories: what is read as Ansible reads it, what is not read, and what is never copied."""

from __future__ import annotations

import errno
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmctl.importing import ansible_hosts
from swarmctl.importing.drafting import DraftError
from tests.importing.drafts import data, draft, lab


def test_variables_have_the_precedence_of_ansible(tmp_path: Path) -> None:
    files = {
        "inventory.ini": "[a]\nx\ny\nz\nw ansible_user=line\n[b:children]\na\n"
        "[a:vars]\nansible_user=child\n[b:vars]\nansible_user=parent\nansible_port=23\n"
        "[all:vars]\nansible_port=24\n",
        "group_vars/b/users.yml": "ansible_user: file-of-parent\n",
        "host_vars/y.yml": "ansible_user: file-of-host\n",
        "host_vars/w": "ansible_user: file-of-w\n",
    }
    hosts = data(draft(lab(tmp_path, files)))["hosts"]
    users = {name: one["user"] for name, one in hosts.items()}
    assert users == {"x": "file-of-parent", "y": "file-of-host", "z": "file-of-parent", "w": "file-of-w"}
    assert {one["port"] for one in hosts.values()} == {23}


def test_both_formats_give_the_same_hosts(tmp_path: Path) -> None:
    ini = "[pis]\nk3 ansible_host=10.0.0.1 ansible_port=2222\n[pis:vars]\nansible_user=pi\n"
    tree = "{hosts: {k3: {ansible_host: 10.0.0.1, ansible_port: 2222}}, vars: {ansible_user: pi}}"
    first = draft(lab(tmp_path / "a", {"hosts.ini": ini}))
    second = draft(lab(tmp_path / "b", {"hosts.yaml": f"all: {{children: {{pis: {tree}}}}}"}))
    assert data(first)["hosts"] == data(second)["hosts"]
    assert data(first)["hosts"] == {"k3": {"address": "10.0.0.1", "user": "pi", "port": 2222}}


def test_its_groups_become_groups(tmp_path: Path) -> None:
    files = {"hosts.ini": "ws\n[Blue_Pis]\na\nb\n[robots:children]\nBlue_Pis\n"}
    found = data(draft(lab(tmp_path, files)))
    assert set(found["hosts"]) == {"ws", "a", "b"}
    assert found["groups"] == {"robots": ["a", "b"], "blue-pis": ["a", "b"]}


def test_a_template_is_not_guessed(tmp_path: Path) -> None:
    files = {"hosts.ini": '[pis]\nk3 ansible_host="{{ base }}.11"\n'}
    found = draft(lab(tmp_path, files))
    assert "# address: 192.168.77.11  # fill in: ansible_host is computed" in found.text


@pytest.mark.parametrize(
    ("variables", "why"),
    [
        ("ansible_connection=winrm", "Linux"),
        ("ansible_connection=local", "runs Ansible"),
        ("ansible_connection=community.docker.docker", "SSH"),
    ],
)
def test_a_computer_without_ssh_is_no_host(variables: str, why: str, tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"hosts.ini": f"[pis]\nk3\nother {variables}\n"}))
    assert list(data(found)["hosts"]) == ["k3"]
    assert why in next(line for line in found.text.split("\n") if "#   hosts.ini: " in line)


def test_an_encrypted_file_is_not_read(tmp_path: Path) -> None:
    files = {"hosts.ini": "[pis]\nk3\n", "host_vars/k3.yml": "$ANSIBLE_VAULT;1.1;AES256\n6231\n"}
    assert "#   host_vars/k3.yml: the whole file is encrypted" in draft(lab(tmp_path, files)).text


@pytest.mark.parametrize(
    "files",
    [
        {"hosts.ini": "[pis]\nk3\n", "host_vars/k3.yml": 'ansible_password: "hunter2\n'},
        {"hosts.ini": "[pis]\nk3 ansible_password='hunter2\n"},
        {"hosts.ini": "[pis]\nk3 ansible_password=hunter2\np[1:999999999]\n"},
        {"hosts.ini": "[a]\nk3 ansible_password=hunter2\n[a:children]\nb\n[b:children]\na\n"},
    ],
)
def test_what_ansible_cannot_read_is_named_without_a_line_of_it(
    tmp_path: Path, files: dict[str, str]
) -> None:
    with pytest.raises(DraftError) as error:
        draft(lab(tmp_path, files))
    assert error.value.args == (
        "ansible-inventory cannot read hosts.ini",
        "`ansible-inventory --list -i hosts.ini` shows why",
    )


def test_a_full_disk_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_args: object, **_options: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(ansible_hosts, "_listed", full)
    with pytest.raises(DraftError) as error:
        draft(lab(tmp_path, {"hosts.ini": "[pis]\nk3\n"}))
    assert "No space left on device" in error.value.args[0]
    assert "TMPDIR" in error.value.args[1]


def test_without_ansible_its_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DraftError) as error:
        draft(lab(tmp_path, {"hosts.ini": "[pis]\nk3\n"}))
    assert "apt install ansible-core" in error.value.args[1]


@pytest.mark.parametrize("name", ["deploy.sh", "inventory"])
def test_a_script_is_no_inventory_and_is_not_run(tmp_path: Path, name: str) -> None:
    script = "" if name.endswith(".sh") else "#!/bin/sh\n"
    folder = lab(tmp_path, {name: f"{script}touch ran\n# ansible_user=pi\n"})
    (folder / name).chmod(0o755)
    with pytest.raises(DraftError, match="nothing that can be imported"):
        draft(folder)
    assert not (folder / "ran").exists()


NAMES = st.text(st.sampled_from("aK3é_.-: #'\"\\{},&*!|>%@`\t\n\u2028\x85"), min_size=1, max_size=12)
VALUES = st.text(st.characters(max_codepoint=0xFFFF, exclude_categories=["Cs"]), max_size=12)
KEYS = ("ansible_user", "ansible_host", "ansible_port", "robot_type", "ros_master_uri", "note")
SECRET_KEYS = (
    "ansible_password",
    "ansible_ssh_pass",
    "ansible_become_pass",
    "wifi_token",
    "my_secret",
    "vault_x",
)
SECRET = "Xq7-never-shown"


@settings(max_examples=25)
@given(
    st.lists(NAMES, min_size=1, max_size=4, unique=True),
    st.sampled_from(KEYS),
    VALUES,
    st.sampled_from(SECRET_KEYS),
)
def test_no_inventory_changes_the_structure(names: list[str], key: str, value: str, secret: str) -> None:
    hosts = {name: {key: value, secret: SECRET} for name in names} | {"k3-pi": {"ansible_host": "10.0.0.1"}}
    answer = {"_meta": {"hostvars": hosts}, "all": {"children": ["pis"]}, "pis": {"hosts": list(hosts)}}
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setattr(ansible_hosts, "_listed", lambda *_: answer)
        found = draft(lab(Path(folder), {"hosts.ini": "[pis]\nk3-pi\n"}))
    read = data(found)
    assert SECRET not in found.text
    assert set(read) <= {"version", "name", "mode", "leader", "hub", "hosts", "robots", "links", "groups"}
    assert all(set(one) <= {"address", "user", "port"} for one in read["hosts"].values())
    masters = (
        [0, 1] if key == "ros_master_uri" else [0]
    )  # a master that is not a host of the inventory is one
    assert len(read["hosts"]) - len(hosts) in masters


def test_what_is_encrypted_is_left_out(tmp_path: Path) -> None:
    files = {"hosts.ini": "[pis]\nk3\n", "host_vars/k3.yml": "ansible_user: !vault |\n  $ANSIBLE_VAULT;1.1\n"}
    found = draft(lab(tmp_path, files))
    assert "# user: robot  # fill in: ansible_user is encrypted" in found.text


def test_a_master_beside_the_inventory_is_a_host(tmp_path: Path) -> None:
    files = {"hosts.ini": "[pis]\na\nb\n[pis:vars]\nros_master_uri=http://10.0.0.1:11311\n"}
    found = data(draft(lab(tmp_path, files)))
    assert (found["mode"], found["hub"]) == ("central", "master")
    assert found["hosts"]["master"] == {"address": "10.0.0.1"}


def test_options_of_ssh_are_not_copied(tmp_path: Path) -> None:
    files = {"hosts.ini": "[pis]\na ansible_ssh_common_args='-o ProxyJump=me@gate'\n"}
    found = draft(lab(tmp_path, files))
    assert (
        "#   hosts.ini:2: ansible_ssh_common_args of host `a` belongs in ~/.ssh/config; a jump host is `via`"
        in found.text
    )
    assert "me@gate" not in found.text


def test_the_computer_that_runs_ansible_is_no_host(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"hosts": "[all]\nlocalhost ansible_user=ros\npi ansible_host=10.0.0.2\n"}))
    assert list(data(found)["hosts"]) == ["pi"]
    assert "hosts: host `localhost`: `localhost` is the computer that runs Ansible" in found.text


def test_a_host_may_not_be_called_localhost(tmp_path: Path) -> None:
    found = draft(lab(tmp_path, {"hosts": "localhost ansible_host=10.0.0.2\n"}))
    assert list(data(found)["hosts"]) == ["host-localhost"]


def test_an_unknown_variable_is_named_once(tmp_path: Path) -> None:
    text = "".join(f"pi{one} ansible_host=10.0.0.{one} wheel={one}\n" for one in (1, 2, 3))
    found = draft(lab(tmp_path, {"hosts": text}))
    assert found.text.count("wheel") == 1
    assert "hosts: wheel of host `pi1` and 2 more has no key in a spec" in found.text


def test_an_inventory_may_be_a_list_of_hosts(tmp_path: Path) -> None:
    assert list(data(draft(lab(tmp_path, {"hosts": "pi1\npi2\n"})))["hosts"]) == ["pi1", "pi2"]


def test_a_file_of_addresses_and_names_is_no_inventory(tmp_path: Path) -> None:
    with pytest.raises(DraftError, match="nothing that can be imported"):
        draft(lab(tmp_path, {"hosts": "127.0.0.1 localhost\n10.0.0.2 pi\nrouter\n"}))


ROS_2 = """
all:
  vars: {ansible_user: ros, ros_distro: jazzy, ros_domain_id: 42, rmw_implementation: rmw_cyclonedds_cpp}
  children:
    turtlebots:
      hosts:
        tb01: {ansible_host: 192.168.77.21, robot_type: turtlebot4}
        tb02: {ansible_host: 192.168.77.22, robot_type: turtlebot4, ros_domain_id: 43, robot_namespace: bot}
    base:
      hosts:
        desk: {ansible_host: 192.168.77.10, robot_type: turtelbot4}
"""


def test_variables_of_ros_2_are_a_draft_of_ros_2(tmp_path: Path) -> None:
    made = draft(lab(tmp_path, {"hosts.yml": ROS_2}))
    found = data(made)
    assert found["ros"] == {"distro": "jazzy", "rmw": "cyclonedds", "domain": 42}
    assert found["mode"] == "combined"
    assert found["islands"] == {
        "domain-42": {"mode": "central", "hub": "tb01", "hosts": ["tb01", "desk"]},
        "domain-43": {"mode": "central", "hub": "tb02", "hosts": ["tb02"]},
    }
    assert found["robots"] == {
        "tb01": {"type": "turtlebot4", "host": "tb01"},
        "tb02": {"type": "turtlebot4", "host": "tb02", "namespace": "bot"},
    }
    assert "robot_type `turtelbot4` of host `desk` is no type; did you mean `turtlebot4`?" in made.text
    assert "has no key in a spec" not in made.text


def test_an_inventory_and_launch_files_are_one_draft(tmp_path: Path) -> None:
    """Nodes start on the hosts of the inventory, which says what it knows of ROS."""
    files = {
        "hosts.ini": "[robots]\nr1 ansible_host=10.0.0.1\nr2 ansible_host=10.0.0.2\n"
        "[robots:vars]\nros_domain_id=4\n",
        "r1.launch.xml": '<launch><node pkg="p" exec="e" name="n"/></launch>',
        "setup.bash": "source /opt/ros/humble/setup.bash\nexport RMW_IMPLEMENTATION=rmw_cyclonedds_cpp\n",
        "start.sh": "ssh pi@10.0.0.2 ros2 run camera driver\n",
    }
    found = data(draft(lab(tmp_path, files)))
    assert found["hosts"] == {"r1": {"address": "10.0.0.1"}, "r2": {"address": "10.0.0.2", "user": "pi"}}
    assert found["ros"] == {"distro": "humble", "domain": 4, "rmw": "cyclonedds"}
    assert {name: one["host"] for name, one in found["programs"].items()} == {"n": "r1", "driver": "r2"}
    assert found["groups"] == {"robots": ["r1", "r2"]}
