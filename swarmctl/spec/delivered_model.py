"""The ROS packages of its own that a spec delivers to hosts, as it names them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from swarmctl.field_types import Model
from swarmctl.text_patterns import matching

PackageFolder = Annotated[str, matching(
    r"^(\./)?[A-Za-z0-9_][A-Za-z0-9._+-]*(/[A-Za-z0-9_][A-Za-z0-9._+-]*)*$",
    "the path of a folder below that of the spec, like ./src/nav", max_length=255, examples=["./src/nav"],
)]  # fmt: skip
PackageKey = Annotated[str, matching(
    r"^[A-Za-z0-9][A-Za-z0-9._+-]{0,100}$", "a name as package.xml has it: letters, digits and . _ + -",
    examples=["gazebo_ros"],
)]  # fmt: skip
GitAddress = Annotated[str, matching(
    r"^((https?|ssh|git|file)://|/|[A-Za-z0-9._-]+@[A-Za-z0-9._-]+:)[A-Za-z0-9._~:/@%+=,-]+$",
    "a repository is https://HOST/PATH, ssh://, git@HOST:PATH, or an absolute path", max_length=400,
    examples=["https://git.lab.example/nav.git"],
)]  # fmt: skip
GitCommit = Annotated[str, matching(
    r"^[0-9a-f]{40}$", "a commit has 40 hexadecimal digits; `git rev-parse HEAD` prints them",
    examples=["0123456789abcdef0123456789abcdef01234567"],
)]  # fmt: skip


class PackageSource(Model):
    """Where a ROS package is that travels with each release, or many: a folder, or a commit in git."""

    # `from` is a word of Python, so no attribute can be declared under this name.
    __annotations__ = {"from": PackageFolder | None}
    locals()["from"] = Field(
        None,
        description="The folder with its package.xml, from that of the spec.",
        examples=["./src/nav"],
    )
    git: GitAddress | None = Field(
        None, description="The git repository that has it, beside `commit`; fetched without questions."
    )
    commit: GitCommit | None = Field(None, description="The commit of `git`, all 40 digits.")
    path: PackageFolder | None = Field(
        None,
        description="The folder with its package.xml in the repository; its top folder by default.",
        examples=["src/nav"],
    )
    all: bool = Field(
        False,
        description="Whether the folder is that of a workspace: every package in and below it is delivered "
        "where it is used, and the name of the entry is free.",
    )
    skip_keys: tuple[PackageKey, ...] = Field(
        (),
        examples=[["gazebo_ros"]],
        description="Names in its package.xml that hosts need not have; `prepare` does not look for them.",
    )

    @property
    def folder(self) -> str:
        """The folder of the package, from that of the spec or of the repository."""
        return str((self.path if self.git else getattr(self, "from")) or ".").removeprefix("./")

    @property
    def shown(self) -> str:
        """What messages call the folder."""
        return f"{self.git}@{(self.commit or '')[:10]}/{self.folder}" if self.git else self.folder

    @property
    def misfit(self) -> tuple[str, str] | None:
        """The key that does not go with the others, and why; None if all is well."""
        own = getattr(self, "from")
        if own and self.git:
            return "git", "a package comes from a folder or from git, not from both"
        if not own and not self.git:
            return "", "a package needs `from`, or `git` with `commit`"
        if self.git and not self.commit:
            return "git", "`git` needs a `commit`: branches and tags change"
        if not self.git and (self.commit or self.path):
            return ("commit" if self.commit else "path"), "it belongs to `git`"
        return None
