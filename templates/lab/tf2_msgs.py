"""Generates and compiles tf2_msgs/TFMessage, of which there is no wheel: ``tf2_msgs.py PREFIX FOLDER``.

PREFIX is a ROS 2 with its generators; FOLDER gets what the package installs. It needs a compiler.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy

NAME = "tf2_msgs"
IDL = """\
#include "geometry_msgs/msg/TransformStamped.idl"
module tf2_msgs {
  module msg {
    struct TFMessage {
      sequence<geometry_msgs::msg::TransformStamped> transforms;
    };
  };
};
"""
MSG = "geometry_msgs/TransformStamped[] transforms\n"
MANIFEST = f"<package><name>{NAME}</name></package>\n"
USES = ("geometry_msgs", "std_msgs", "builtin_interfaces")  # directly, and through these
C, PY, HASHES = "rosidl_generator_c", "rosidl_generator_py", "rosidl_generator_type_description"
FASTRTPS, INTROSPECTION, DISPATCH = (
    f"rosidl_typesupport_{one}" for one in ("fastrtps_c", "introspection_c", "c")
)
#: The libraries in the order in which they are made: what each links, besides those of its kind of ``USES``.
LIBRARIES = {
    C: ("rosidl_runtime_c", "rcutils"),
    FASTRTPS: (f"{NAME}__{C}", FASTRTPS, "rosidl_typesupport_fastrtps_cpp", "rosidl_runtime_c", "fastcdr"),
    INTROSPECTION: (f"{NAME}__{C}", INTROSPECTION, "rosidl_runtime_c"),
    DISPATCH: (f"{NAME}__{C}", DISPATCH),
    PY: (f"{NAME}__{C}", f"{NAME}__{DISPATCH}", *(f"{one}__{C}" for one in USES)),
}
#: Options of the generators.
OPTIONS = {
    DISPATCH: ("--typesupports", FASTRTPS, INTROSPECTION),
    PY: ("--typesupport-impls", f"{FASTRTPS};{INTROSPECTION};{DISPATCH}"),
}
SITE = f"lib/python{sys.version_info.major}.{sys.version_info.minor}/site-packages"


def main(prefix: Path, folder: Path) -> None:
    """Raises CalledProcessError if a program fails; its output has the reason."""
    with tempfile.TemporaryDirectory() as place:
        sources = Path(place)
        generate(prefix, sources)
        (folder / "lib").mkdir(parents=True)
        package = folder / SITE / NAME
        shutil.copytree(sources / PY / NAME, package, ignore=shutil.ignore_patterns("*.c"))
        (package / "__init__.py").touch()
        for library, files, links in libraries(prefix, sources, folder):
            subprocess.run(compiler(prefix, sources, library, files, folder, links), check=True)
    share, index = folder / "share" / NAME, folder / "share/ament_index/resource_index/packages"
    for path in (share / "msg", index):
        path.mkdir(parents=True)
    (share / "package.xml").write_text(MANIFEST)
    (share / "msg/TFMessage.msg").write_text(MSG)
    (index / NAME).touch()


def generate(prefix: Path, sources: Path) -> None:
    """Writes the sources of each kind into a folder of its name."""
    idl = sources / "msg/TFMessage.idl"
    idl.parent.mkdir()
    idl.write_text(IDL)
    environment = {**os.environ, "PYTHONPATH": str(prefix / SITE), "LD_LIBRARY_PATH": str(prefix / "lib")}
    for kind in (HASHES, *LIBRARIES):
        templates, output = prefix / "share" / kind / "resource", sources / kind / NAME
        output.mkdir(parents=True)
        file = sources / f"{kind}.json"
        arguments = {
            "package_name": NAME,
            "output_dir": str(output),
            "template_dir": str(templates),
            "idl_tuples": [f"{sources}:msg/TFMessage.idl"],
            "include_paths": [f"{one}:{prefix}/share/{one}" for one in USES],
            "type_description_tuples": [f"msg/TFMessage.idl:{sources}/{HASHES}/{NAME}/msg/TFMessage.json"],
            "ros_interface_dependencies": [],
            "target_dependencies": [],
        }
        file.write_text(json.dumps(arguments))
        argv = (sys.executable, prefix / "lib" / kind / kind, "--generator-arguments-file", file)
        subprocess.run([*argv, *OPTIONS.get(kind, ())], check=True, env=environment)
        for template in templates.glob(f"{kind}__visibility_control.h.in"):
            text = template.read_text().replace("@PROJECT_NAME@", NAME)
            header = output / "msg" / template.stem
            header.write_text(text.replace("@PROJECT_NAME_UPPER@", NAME.upper()))


def libraries(
    prefix: Path, sources: Path, folder: Path
) -> Iterator[tuple[Path, Sequence[Path], Sequence[str]]]:
    """Yields each library with its sources and what it links: those of ROS, then the modules of Python."""
    modules = sorted((sources / PY).rglob("*.ep.*.c"))
    for kind, links in LIBRARIES.items():
        files = sorted({*(sources / kind).rglob("*.c"), *(sources / kind).rglob("*.cpp")} - {*modules})
        used = [f"{one}__{kind}" for one in USES if (prefix / f"lib/lib{one}__{kind}.so").exists()]
        yield folder / f"lib/lib{NAME}__{kind}.so", files, (*links, *used)
    for module in modules:
        support = module.name.split(".")[2]
        links = (f"{NAME}__{PY}", f"{NAME}__{support}", f"{NAME}__{DISPATCH}", DISPATCH, "rosidl_runtime_c")
        yield folder / SITE / NAME / f"{NAME}_s__{support}.so", [module], links


def compiler(  # noqa: PLR0917
    prefix: Path, sources: Path, library: Path, files: Sequence[Path], folder: Path, links: Sequence[str]
) -> Sequence[str]:
    """Returns the command that makes a shared library."""
    headers = (
        *(sources / kind for kind in LIBRARIES),
        *(prefix / "include", *sorted((prefix / "include").iterdir())),
        *(sysconfig.get_path("include"), numpy.get_include()),
    )
    return (
        *("g++" if files[0].suffix == ".cpp" else "gcc", "-shared", "-fPIC", "-O2", "-o", str(library)),
        *(f"-I{one}" for one in headers),
        *map(str, files),
        *(f"-L{folder}/lib", f"-L{prefix}/lib", f"-Wl,-rpath-link,{prefix}/lib"),
        *(f"-l{one}" for one in links),
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
