"""The image: named by its recipe, whole or not at all, and its build says how far it is."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from swarmctl.lab import paths
from swarmctl.lab.errors import LabError
from swarmctl.lab.hosts import containers, disks, image
from swarmctl.lab.hosts.disks import Accounts, Entry
from swarmctl.lab.lab_plan import LabHost

ACCOUNTS = Accounts(
    passwd="root:x:0:0:root:/root:/bin/bash\ndaemon:x:1:1::/:/sbin/nologin\n",
    group="root:x:0:\ndialout:x:20:\nsudo:x:27:ann\n",
    shadow="root:*:1::::::\n",
)


def quiet(_: str) -> None:
    pass


def test_the_digest_depends_on_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    before = image.digest()
    assert before == image.digest()
    monkeypatch.setattr(image, "PACKAGES", (*image.PACKAGES, "cowsay"))
    assert image.digest() != before
    assert "cowsay" in next(word for word in image.bootstrap_argv(Path("/i")) if word.startswith("--include"))


def test_a_lab_with_containers_has_an_image_with_their_engine() -> None:
    assert containers.packages_of(["docker", "podman"]) == ("podman", "runc")  # no docker in a lab
    assert containers.settings_of(["catkin"]) == {}
    (settings,) = containers.settings_of(["catkin", "podman", "runc"]).values()
    assert 'runtime = "runc"' in settings


def test_the_digest_depends_on_the_settings_of_the_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, before = image.digest(), image.digest(("podman", "runc"))
    monkeypatch.setattr(containers, "FILES", {"etc/other": "x"})
    assert image.digest(("podman", "runc")) != before
    assert image.digest() == plain


@pytest.mark.parametrize("part", ["RECIPE", "SUITE", "MASKED", "BUILD_LEFTOVERS"])
def test_the_digest_depends_on_the_whole_recipe(monkeypatch: pytest.MonkeyPatch, part: str) -> None:
    before = image.digest()
    monkeypatch.setattr(image, part, "other")
    assert image.digest() != before


def test_the_cache_can_be_moved(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(paths.CACHE_VARIABLE, str(tmp_path))
    there = tmp_path / f"image-{image.digest()}"
    there.mkdir()
    assert image.ensure(quiet) == there


def test_an_image_is_built_once(tmp_path: Path) -> None:
    made = []

    def make(folder: Path, say: image.Say) -> None:
        made.append(folder)
        say("at work")
        (folder / "bin").mkdir()

    notes: list[str] = []
    both = [
        threading.Thread(target=lambda: image.build_once(tmp_path / "image", make, notes.append))
        for _ in range(2)
    ]
    for one in both:
        one.start()
    for one in both:
        one.join()
    assert (len(made), notes) == (1, ["at work"])
    assert (tmp_path / "image/bin").is_dir()
    assert not list(tmp_path.glob(".image.new-*"))


@pytest.mark.parametrize("failure", [LabError("no network"), KeyboardInterrupt()])
def test_a_partial_image_is_not_used(tmp_path: Path, failure: BaseException) -> None:
    def make(folder: Path, _: image.Say) -> None:
        (folder / "half").mkdir()
        raise failure

    with pytest.raises(type(failure)):
        image.build_once(tmp_path / "image", make, quiet)
    assert [path.name for path in tmp_path.iterdir()] == [".image.lock"]


def test_leftovers_of_a_killed_build_are_removed(tmp_path: Path) -> None:
    (tmp_path / ".image.new-x/bin").mkdir(parents=True)
    image.build_once(tmp_path / "image", lambda folder, say: None, quiet)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".image.lock", "image"]


def test_a_failed_bootstrap_reports_its_output() -> None:
    with pytest.raises(LabError, match="ended with status 3") as failure:
        image._bootstrap(("sh", "-c", "echo I: begun; echo E: no space >&2; exit 3"), quiet)
    assert failure.value.help_lines == ("I: begun", "E: no space")


def test_an_interrupted_bootstrap_ends_its_processes(tmp_path: Path) -> None:
    def interrupt(_: str) -> None:
        raise KeyboardInterrupt

    script = f"echo I: begun; sleep 0.2; touch {tmp_path}/late"
    with pytest.raises(KeyboardInterrupt):
        image._bootstrap(("sh", "-c", script), interrupt)
    threading.Event().wait(0.3)
    assert not (tmp_path / "late").exists()


def test_a_long_build_reports_progress() -> None:
    clock = iter(range(0, 100, 2)).__next__  # each look at the clock is 2 s later
    lines = [
        "I: installing remaining packages", "Get:1 http://x y", "0 upgraded, 2 newly installed, 0 to remove.",
        "Unpacking a (1.0) ...", "Unpacking b:amd64 (1.0) ...",
        "Setting up a (1.0) ...", "Setting up b:amd64 (1.0) ...",
    ]  # fmt: skip
    assert list(image.progress(lines, clock)) == [
        "installing remaining packages",
        " 50 %  unpacking b",
        "100 %  setting up b",
    ]


def test_a_finished_image_has_no_files_of_the_build_machine(tmp_path: Path) -> None:
    for path in ("etc/ssh", "etc/systemd/system"):
        (tmp_path / path).mkdir(parents=True)
    for stranger in ("etc/hostname", "etc/resolv.conf", "etc/ssh/ssh_host_rsa_key"):
        (tmp_path / stranger).write_text("builder")
    image.finish(tmp_path)
    assert not (tmp_path / "etc/hostname").exists()
    assert not list((tmp_path / "etc/ssh").iterdir())
    assert (tmp_path / "etc/resolv.conf").read_text() == (tmp_path / "etc/machine-id").read_text() == ""
    units = tmp_path / "etc/systemd/system"
    assert (units / "apt-daily.timer").readlink() == Path("/dev/null")
    assert (units / "multi-user.target.wants/ssh.service").is_symlink()


def entries(user: str, port: int = 22) -> dict[str, Entry]:
    host = LabHost("h", "10.0.0.1", user, port, ())
    return {one.path: one for one in disks.entries(host, ACCOUNTS, "secret", "public", "f00")}


@pytest.mark.parametrize("user", ["jane.doe", "ROBOT"])
def test_sudo_reads_the_rights_of_any_account(user: str) -> None:
    found = entries(user)
    assert found["etc/sudoers.d/account"].content.startswith("#1000 ")
    assert f"home/{user}/.ssh/authorized_keys" in found


def test_a_host_has_its_user_with_sudo_and_serial_ports() -> None:
    found = entries("robot", 2222)
    assert found["etc/group"].content == "root:x:0:\ndialout:x:20:robot\nsudo:x:27:ann,robot\nrobot:x:1000:\n"
    assert found["etc/passwd"].content == f"{ACCOUNTS.passwd}robot:x:1000:1000:robot:/home/robot:/bin/bash\n"
    assert found["etc/sudoers.d/account"].mode == 0o440
    assert found["home/robot/.ssh/authorized_keys"] == Entry(
        "home/robot/.ssh/authorized_keys", "public", 0o600, 1000
    )
    assert found["etc/ssh/ssh_host_ed25519_key"].mode == 0o600
    settings = found["etc/ssh/sshd_config.d/lab.conf"].content
    assert "Port 2222\n" in settings
    assert "PermitRootLogin no\n" in settings


def test_a_root_host_has_no_extra_account() -> None:
    found = entries("root")
    assert "etc/passwd" not in found
    assert found["root/.ssh/authorized_keys"].mode == 0o600
    assert "PermitRootLogin prohibit-password\n" in found["etc/ssh/sshd_config.d/lab.conf"].content


def test_a_system_account_is_refused() -> None:
    with pytest.raises(LabError, match="`daemon` is a system account"):
        entries("daemon")
