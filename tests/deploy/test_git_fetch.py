"""Packages of a git commit: fetched once, without questions, and nothing of the repository is run."""

from __future__ import annotations

import errno
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from swarmctl.cli.spec_args import SpecFiles
from swarmctl.cli.spec_loading import loaded
from swarmctl.deploy import git_fetch
from swarmctl.deploy.git_fetch import GitFetchError, fetch
from swarmctl.spec.git_checkouts import checkout_of, checkouts
from tests.rules.test_delivered_packages import GO, NAV
from tests.rules.test_packages import SPEC, write


def git(folder: Path, *arguments: str) -> str:
    known = ("-c", "user.name=a", "-c", "user.email=a@b.example", "-c", "init.defaultBranch=main")
    done = subprocess.run(["git", *known, *arguments], cwd=folder, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.fixture
def repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Path, str]:
    """A repository whose package has moved on since the commit."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "repository"
    folder.mkdir()
    git(folder, "init", "--quiet")
    write(folder, {"src/nav/package.xml": NAV, "src/nav/scripts/go.py": GO, "README.md": "x"})
    (folder / "src/nav/scripts/go.py").chmod(0o755)
    (folder / "src/nav/passwords").symlink_to("/etc/passwd")
    git(folder, "add", ".")
    git(folder, "commit", "--quiet", "-m", "first")
    commit = git(folder, "rev-parse", "HEAD")
    (folder / "src/nav/scripts/go.py").write_text("other")
    git(folder, "commit", "--quiet", "-am", "second")
    return folder, commit


def spec(folder: Path, source: str) -> SpecFiles:
    text = SPEC.format(program="executable: go.py").replace("own, exec", "nav, exec")
    write(folder, {"swarm.yaml": f"{text}packages: {{nav: {{{source}}}}}\n"})
    return SpecFiles((folder / "swarm.yaml",))


def test_a_commit_is_delivered_as_it_was(tmp_path: Path, repository: tuple[Path, str]) -> None:
    folder, commit = repository
    document, found = loaded(spec(tmp_path, f'git: "file://{folder}", commit: "{commit}", path: src/nav'))
    assert document is not None, found
    nav = document.packages.delivered["nav"]
    assert nav.files == {"package.xml": (NAV.encode(), False), "scripts/go.py": (GO.encode(), True)}
    assert nav.folder == f"file://{folder}@{commit[:10]}/src/nav"


def test_a_fetched_commit_needs_no_network(
    tmp_path: Path, repository: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, commit = repository
    files = spec(tmp_path, f'git: "{folder}", commit: "{commit}", path: src/nav')
    assert loaded(files)[0] is not None
    folder.rename(tmp_path / "away")
    monkeypatch.setattr(git_fetch, "fetch", None)
    assert loaded(files)[0] is not None


def test_two_runs_may_fetch_one_commit(repository: tuple[Path, str]) -> None:
    folder, commit = repository
    place = checkout_of(str(folder), commit)
    for _ in range(2):  # the second one finds the files of the first only at its end
        fetch(str(folder), commit, place)
    assert sorted(one.name for one in place.iterdir()) == ["README.md", "src"]
    assert list(checkouts().iterdir()) == [place]


def test_what_cannot_be_fetched_is_an_error(tmp_path: Path, repository: tuple[Path, str]) -> None:
    folder, commit = repository
    for address, wanted, reason in (
        (f"{folder}-not", commit, "does not appear to be a git repository"),
        (str(folder), "0" * 40, f"has no commit {'0' * 40}"),
    ):
        document, found = loaded(spec(tmp_path, f'git: "{address}", commit: "{wanted}"'))
        assert document is None
        (finding,) = [one for one in found.diagnostics if one.code == "PKG017"]
        assert finding.message == f"`{address}@{wanted[:10]}/.` is not fetched"
        assert finding.span is not None
        assert reason in finding.help[0]
    assert list(checkouts().iterdir()) == []


def test_many_packages_of_one_commit_are_fetched_once(
    tmp_path: Path, repository: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, commit = repository
    tried: list[str] = []
    real = subprocess.run

    def run(argv: list[str], **options: Any) -> Any:
        if "fetch" in argv:
            tried.append(argv[-1])
            if "-not" in argv[-2]:
                raise subprocess.TimeoutExpired(argv, 600.0)
        return real(argv, **options)

    monkeypatch.setattr(git_fetch.subprocess, "run", run)
    entries = [f'p{at}: {{git: "{folder}", commit: "{commit}"}}' for at in range(20)]
    entries += [f'q{at}: {{git: "{folder}-not", commit: "{at:02d}{commit[2:]}"}}' for at in range(20)]
    path = tmp_path / "swarm.yaml"
    path.write_text(f"packages: {{{', '.join(entries)}}}\n")
    failed = git_fetch.fetch_missing([path])
    assert (len(failed), tried) == (20, [commit, f"00{commit[2:]}"])
    assert [one.name for one in checkouts().iterdir()] == [checkout_of(str(folder), commit).name]


@pytest.mark.parametrize("place", ["git", "files"])
def test_a_full_disk_leaves_nothing_of_a_commit(
    tmp_path: Path, repository: tuple[Path, str], monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    folder, commit = repository
    if place == "git":
        git_of_a_full_disk = "#!/bin/sh\necho 'fatal: write error: No space left on device' >&2; exit 128\n"
        (tmp_path / "bin").mkdir()
        (tmp_path / "bin/git").write_text(git_of_a_full_disk)
        (tmp_path / "bin/git").chmod(0o755)
        monkeypatch.setenv("PATH", f"{tmp_path}/bin:{os.environ['PATH']}")
    else:
        monkeypatch.setattr(git_fetch.shutil, "copyfileobj", full)
    document, found = loaded(spec(tmp_path, f'git: "{folder}", commit: "{commit}", path: src/nav'))
    assert document is None
    (finding,) = [one for one in found.diagnostics if one.code == "PKG017"]
    assert "No space left on device" in finding.help[0]
    assert "free space, or set XDG_CACHE_HOME" in finding.help[0]
    assert list(checkouts().iterdir()) == []


def full(path: Path, content: bytes) -> int:
    """What a full disk does to a write."""
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))


def test_nothing_of_a_repository_runs(
    tmp_path: Path, repository: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, commit = repository
    hooks = tmp_path / "hooks"
    write(
        hooks, dict.fromkeys(("post-checkout", "reference-transaction"), f"#!/bin/sh\ntouch {tmp_path}/ran\n")
    )
    for hook in hooks.iterdir():
        hook.chmod(0o755)
    monkeypatch.setenv("HOME", str(tmp_path))
    write(tmp_path, {".gitconfig": f"[core]\n  hooksPath = {hooks}\n"})
    fetch(str(folder), commit, checkout_of(str(folder), commit))
    with pytest.raises(GitFetchError, match="has no commit"):  # after a fetch of all branches
        fetch(str(folder), "0" * 40, tmp_path / "cache/x")
    assert not (tmp_path / "ran").exists()
    with pytest.raises(GitFetchError, match="not allowed"):
        fetch(f"ext::sh -c 'touch {tmp_path}/ran'", commit, tmp_path / "cache/x")
    assert not (tmp_path / "ran").exists()


def test_the_oldest_commits_go_first(
    tmp_path: Path, repository: tuple[Path, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, commit = repository
    fetch(str(folder), commit, checkout_of(str(folder), commit))
    monkeypatch.setattr(git_fetch, "MAX_BYTES", 100)
    fetch(f"file://{folder}", commit, checkout_of(f"file://{folder}", commit))
    assert list(checkouts().iterdir()) == [checkout_of(f"file://{folder}", commit)]
    monkeypatch.setattr(git_fetch, "MAX_COMMIT", 10)
    with pytest.raises(GitFetchError, match="is larger than"):
        fetch(str(folder), commit, checkout_of(str(folder), commit))


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("skip_keys: [a]", "a package needs `from`, or `git` with `commit`"),
        (
            f'from: src/nav, git: /srv/nav.git, commit: "{"a" * 40}"',
            "from a folder or from git, not from both",
        ),
        ("git: /srv/nav.git", "`git` needs a `commit`"),
        ("from: src/nav, path: src", "it belongs to `git`"),
    ],
)
def test_a_package_has_one_source(tmp_path: Path, source: str, message: str) -> None:
    document, found = loaded(spec(tmp_path, source))
    assert document is None
    (finding,) = [one for one in found.diagnostics if one.code == "PKG019"]
    assert message in finding.message
    assert finding.span is not None
