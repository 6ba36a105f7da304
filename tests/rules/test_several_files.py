"""A spec in several files: included, laid over, and every finding shown in the file where it stands."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.links.serial_link import FixedLine
from swarmctl.spec.load import Document, load
from swarmctl.swarm.resolved import Swarm
from swarmctl.yamltext.files import MAX_BYTES, MAX_CHAIN, MAX_FILES
from tests.loading import load_swarm

SEVERAL = Path(__file__).parent / "several_files"
CASES = sorted(folder for folder in SEVERAL.iterdir() if folder.is_dir())

HEAD = "version: 1\nname: newswarm\nmode: leader\nleader: koala-laptop\n"
HOSTS = """
hosts:
  koala-laptop: {address: 192.168.77.10}
  k3-pi: {address: 192.168.77.11}
"""
ROBOTS = """
robots:
  koala: {type: koala, host: koala-laptop}
  k3: {type: khepera3, host: k3-pi}
"""
LINKS = """
links:
  - {kind: wlan, name: lab, hosts: [koala-laptop, k3-pi]}
  - {kind: serial, host: koala-laptop, robot: koala, usb: {serial: A600dXyz}, baud: 38400}
  - {kind: serial, host: k3-pi, robot: k3, usb: {serial: FTDI1234}}
"""
WHOLE = HEAD + HOSTS + ROBOTS + LINKS


@pytest.fixture(autouse=True)
def plain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_message(
    case: Path,
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(case)
    overlay = ["-f", "field.yaml"] if Path("field.yaml").exists() else []
    assert run(["validate", "swarm.yaml", *overlay]) == exit_codes.ERROR
    printed = capsys.readouterr()
    assert printed.out == ""
    golden(case / "message.txt", printed.err)


def written(folder: Path, **files: str) -> Path:
    for name, text in files.items():
        path = folder / f"{name.replace('__', '/')}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, "utf-8")
    return folder / "swarm.yaml"


def valid(*layers: Path) -> Swarm:
    swarm, found = load_swarm(*layers)
    assert found == ()
    assert swarm is not None
    return swarm


def document(*layers: Path) -> Document:
    found, _ = load(layers)
    assert found is not None
    return found


def codes(*layers: Path) -> list[str]:
    return [one.code for one in load_swarm(*layers)[1]]


def test_a_spec_may_lie_in_several_files(tmp_path: Path) -> None:
    whole = valid(written(tmp_path / "whole", swarm=WHOLE))
    parts = written(
        tmp_path / "parts",
        swarm="include: [hosts.yaml, robots/lab.yaml]\n" + HEAD,
        hosts=HOSTS,
        robots__lab="include: ../links.yaml\n" + ROBOTS,
        links=LINKS,
    )
    assert valid(parts) == whole


def test_sections_of_several_files_are_joined(tmp_path: Path) -> None:
    hosts, robots, links = (text.splitlines(keepends=True) for text in (HOSTS, ROBOTS, LINKS))
    first = "".join([*hosts[:3], *robots[:3], *links[:4]])
    second = "".join(["hosts:\n", hosts[3], "robots:\n", robots[3], "links:\n", links[4]])
    spec = written(tmp_path, swarm="include: second.yaml\n" + HEAD + first, second=second)
    assert valid(spec) == valid(written(tmp_path / "whole", swarm=WHOLE))


def test_each_value_has_its_file(tmp_path: Path) -> None:
    spec = written(
        tmp_path,
        swarm="include: hosts.yaml\n" + HEAD + ROBOTS + LINKS,
        hosts=HOSTS,
        field="hosts:\n  k3-pi:\n    address: 10.0.0.9\nlinks:\n  - {robot: koala, baud: 115200}\n",
    )
    found = document(spec, tmp_path / "field.yaml")

    def stands(*loc: str | int, key: bool = False) -> tuple[str, int]:
        span = found.span(*loc, key=key)
        return Path(span.file).name, span.line

    assert stands("hosts", "koala-laptop", "address") == ("hosts.yaml", 3)
    assert stands("hosts", "k3-pi", key=True) == ("hosts.yaml", 4)
    assert stands("hosts", "k3-pi", "address") == ("field.yaml", 3)
    assert stands("robots", "k3", "host") == ("swarm.yaml", 9)
    assert stands("links", 1, "baud") == ("field.yaml", 5)
    assert stands("links", 1, "usb", "serial") == ("swarm.yaml", 13)
    assert set(found.source.texts) == {str(spec), str(tmp_path / "hosts.yaml"), str(tmp_path / "field.yaml")}


def test_an_included_file_in_the_folder_of_robot_types_is_none(tmp_path: Path) -> None:
    spec = written(tmp_path, swarm="include: robots/lab.yaml\n" + HEAD + HOSTS + LINKS, robots__lab=ROBOTS)
    assert "lab" not in document(spec).types
    assert codes(spec) == []


def test_links_and_chains_of_files_end(tmp_path: Path) -> None:
    folder = tmp_path / "links"
    written(folder, hosts=HOSTS, swarm="include: same.yaml\n" + HEAD + HOSTS + ROBOTS + LINKS)
    (folder / "same.yaml").symlink_to("swarm.yaml")
    assert codes(folder / "swarm.yaml") == ["INC003"]
    (folder / "same.yaml").unlink()
    (folder / "same.yaml").symlink_to("same.yaml")
    assert codes(folder / "swarm.yaml") == ["FILE001"]
    (folder / "same.yaml").unlink()
    (tmp_path / "secret.yaml").write_text("root: $6$hash\n")
    (folder / "same.yaml").symlink_to("../secret.yaml")
    assert codes(folder / "swarm.yaml") == ["INC002"]
    chain = {f"f{number}": f"include: f{number + 1}.yaml\n" for number in range(MAX_CHAIN + 5)}
    spec = written(tmp_path / "chain", swarm="include: f0.yaml\n" + WHOLE, **chain)
    assert codes(spec) == ["INC003"]


def test_devices_and_pipes_are_not_opened(tmp_path: Path) -> None:
    spec = written(tmp_path, swarm="include: [pipe.yaml]\n" + WHOLE)
    os.mkfifo(tmp_path / "pipe.yaml")
    assert codes(spec) == ["INC001"]


def test_all_files_together_have_one_limit(tmp_path: Path) -> None:
    many = {f"f{number}": "programs: {}\n" for number in range(MAX_FILES)}
    names = ", ".join(f"f{number}.yaml" for number in range(MAX_FILES))
    spec = written(tmp_path / "many", swarm=f"include: [{names}]\n" + WHOLE, **many)
    assert codes(spec) == ["FILE002"]
    large = {f"f{number}": "# " + "x" * (MAX_BYTES // 2) + "\nprograms: {}\n" for number in range(2)}
    spec = written(tmp_path / "large", swarm="include: [f0.yaml, f1.yaml]\n" + WHOLE, **large)
    assert codes(spec) == ["FILE002"]
    nodes = {f"f{number}": f"robots: [{'a,' * 160_000}]\n" for number in range(2)}
    spec = written(tmp_path / "nodes", swarm="include: [f0.yaml, f1.yaml]\n" + WHOLE, **nodes)
    assert codes(spec) == ["YAML002", "YAML014"]  # `robots` is a list in one file, a mapping in another


def laid(tmp_path: Path, *overlays: str, base: str = WHOLE) -> Swarm:
    names = [f"o{number}" for number in range(len(overlays))]
    spec = written(tmp_path, swarm=base, **dict(zip(names, overlays, strict=True)))
    return valid(spec, *(tmp_path / f"{name}.yaml" for name in names))


def test_an_overlay_has_only_the_differences(tmp_path: Path) -> None:
    swarm = laid(
        tmp_path,
        "hosts: {k3-pi: {address: 192.168.77.9}}\nlinks: [{name: lab, subnet: 192.168.0.0/16}]\n",
        "links:\n  - {robot: k3, device: /dev/ttyS0, usb: ~}\n",
    )
    assert swarm.hosts["k3-pi"].address == "192.168.77.9"
    assert swarm.hosts["koala-laptop"].address == "192.168.77.10"
    assert [network.subnet for network in swarm.networks] == ["192.168.0.0/16"]
    assert swarm.robots["k3"].line == FixedLine("/dev/ttyS0")
    assert swarm.robots["koala"].baud == 38400


def test_an_overlay_removes_and_adds(tmp_path: Path) -> None:
    swarm = laid(
        tmp_path,
        """
robots: {k3: ~, epuck: {type: epuck, host: k3-pi}}
hosts: {k3-pi: {bluetooth: [hci0]}}
links:
  - {robot: k3, kind: ~}
  - {kind: bluetooth, host: k3-pi, robot: epuck, mac: "10:00:e8:c5:64:37"}
""",
    )
    assert list(swarm.robots) == ["koala", "epuck"]


def test_a_fix_writes_a_key_where_the_overlay_removes_it(tmp_path: Path) -> None:
    field = "robots:\n  k3: {host: ~}\n"
    spec = written(tmp_path, swarm=WHOLE, field=field)
    assert codes(spec, tmp_path / "field.yaml") == ["MODE004"]
    assert run(["validate", str(spec), "-f", str(tmp_path / "field.yaml"), "--fix"]) == exit_codes.OK
    assert spec.read_text("utf-8") == WHOLE
    assert (tmp_path / "field.yaml").read_text("utf-8") == field.replace("~", "k3-pi")


def test_an_empty_overlay_changes_nothing(tmp_path: Path) -> None:
    assert laid(tmp_path, "# nothing yet\n") == valid(written(tmp_path / "alone", swarm=WHOLE))


def test_a_link_of_another_kind_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    swarm = laid(
        tmp_path,
        """
robots: {k3: {type: epuck}}
hosts: {k3-pi: {bluetooth: [hci0]}}
links: [{kind: bluetooth, robot: k3, host: k3-pi, mac: "10:00:e8:c5:64:37"}]
""",
    )
    assert "mac" in vars(swarm.robots["k3"].line)


def test_an_overlay_changes_only_its_place_of_an_alias(tmp_path: Path) -> None:
    base = WHOLE.replace("robots:\n", "robots:\n  more: &it {type: koala, host: koala-laptop}\n").replace(
        "koala: {type: koala, host: koala-laptop}", "koala: *it"
    )
    base = base.replace(
        "links:\n", "links:\n  - {kind: serial, host: k3-pi, robot: more, device: /dev/ttyS1}\n"
    )
    swarm = laid(tmp_path, "robots: {more: {host: k3-pi}}\n", base=base)
    assert swarm.robots["more"].host == "k3-pi"
    assert swarm.robots["koala"].host == "koala-laptop"


def test_aliases_of_aliases_in_both_layers_end_soon(tmp_path: Path) -> None:
    pyramid = "a0: &a0 {x: 1}\n" + "".join(
        f"a{n}: &a{n} {{{', '.join(f'{key}: *a{n - 1}' for key in 'pqrstuvw')}}}\n" for n in range(1, 30)
    )
    spec = written(tmp_path, swarm=pyramid, field=pyramid)
    assert "YAML008" in codes(spec, tmp_path / "field.yaml")
    spec = written(tmp_path, swarm="a: &a {b: *a}\n", field="a: &a {b: *a}\n")
    assert codes(spec, tmp_path / "field.yaml") == ["YAML004"]


def test_the_command_line_takes_layers_and_several_specs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path, swarm=WHOLE, field="name: field\n", broken=HEAD)
    monkeypatch.chdir(tmp_path)
    assert run(["validate", "swarm.yaml", "-f", "field.yaml"]) == exit_codes.OK
    assert run(["validate", "-f", "swarm.yaml", "-f", "field.yaml"]) == exit_codes.OK
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 2
    assert all(line.startswith("swarm.yaml -f field.yaml: swarm `field` is valid") for line in printed)
    assert run(["validate", "broken.yaml", "swarm.yaml"]) == exit_codes.ERROR
    assert run(["validate", "swarm.yaml", "swarm.yaml"]) == exit_codes.OK
    assert run(["render", "-f", "swarm.yaml", "-f", "field.yaml", "--out", "out"]) == exit_codes.OK
    assert "name: field" not in Path("swarm.yaml").read_text("utf-8")
    assert {one.name for one in Path("out").iterdir()} == {"koala-laptop", "k3-pi"}


def test_specs_may_be_read_from_elsewhere_than_the_disk() -> None:
    files = {"a.yaml": "include: b.yaml\n" + HEAD + ROBOTS + LINKS, "b.yaml": HOSTS}
    found, diagnostics = load((Path("a.yaml"),), read=lambda path: files[str(path)].encode())
    assert diagnostics == ()
    assert found is not None
    assert list(found.spec.hosts) == ["koala-laptop", "k3-pi"]
