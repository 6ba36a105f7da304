"""How a camera is set, and known by its answer: the bytes for every number, written here by other means."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.robot_types.binary_protocol import BinaryQuery
from swarmctl.robot_types.sensors import Preparation
from swarmctl.spec.catalog import load_catalog
from tests import ROOT

SIZES = {"B": 1, "H": 2, "I": 4}
KEYS = ("mode", "width", "height", "zoom")
SHIPPED = ROOT / "templates/robots/epuck-binary.yaml"
SETTINGS = "width: 40\n    height: 40\n    zoom: 8"
PREPARE = "4a 2c {mode:t} 2c {width:t} 2c {height:t} 2c {zoom:t} 0d"
REPLY = '"{mode:B} {width:B} {height:B} {pixels}"'

settings = st.fixed_dictionaries({key: st.integers(0, 65535) for key in KEYS})
places = st.tuples(st.sampled_from(KEYS), st.sampled_from("tHI"))
byte = st.integers(0, 255)


def place(key: str, code: str) -> str:
    return f"{{{key}:{code}}}"


@given(settings, st.lists(byte | places, min_size=1, max_size=12), st.sampled_from(["little", "big"]))
def test_a_request_has_each_number_where_and_as_its_place_says(numbers, tokens, order):
    send = " ".join(f"{one:02x}" if isinstance(one, int) else place(*one) for one in tokens)
    expected = b""
    for one in tokens:
        if isinstance(one, int):
            expected += bytes([one])
        elif one[1] == "t":
            expected += b"%d" % numbers[one[0]]
        else:
            expected += numbers[one[0]].to_bytes(SIZES[one[1]], order)
    request = Preparation(send=send.ljust(2)).filled(numbers, order)
    assert bytes.fromhex(request.send) == expected


@given(
    settings,
    st.lists(st.tuples(st.sampled_from(KEYS), st.sampled_from("BHI")), max_size=5),
    st.integers(1, 999),
)
def test_an_answer_begins_with_the_settings_cut_to_their_places(numbers, repeated, pixels):
    reply = " ".join([place(*one) for one in repeated] + ["{pixels}"])
    query = BinaryQuery(send="b7", reply=reply).filled(numbers, pixels)
    assert query.begins == tuple(numbers[key] % 256 ** SIZES[code] for key, code in repeated)
    assert query.length(0)[1] == sum(SIZES[code] for _, code in repeated) + pixels


def test_what_an_image_always_begins_with_is_still_looked_at():
    query = BinaryQuery(send="b7", reply="2B {pixels}", begins=(85, 170))
    assert query.filled(dict.fromkeys(KEYS, 1), 4).begins == (85, 170)


def own(folder: Path, *changes: tuple[str, str]) -> str:
    """A type of one's own from the e-puck's, with ``changes``."""
    text = SHIPPED.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / "robots").mkdir(exist_ok=True)
    (folder / "robots/own.yaml").write_text(text, "utf-8")
    return text


@pytest.mark.parametrize(
    ("change", "message", "pointed_at"),
    [
        ((REPLY, '"{mode:B} 2B"'), "ends with its `{pixels}`", '"{mode:B} 2B"'),
        ((REPLY, '"{pixels} 3B"'), "the pixels come last", '"{pixels} 3B"'),
        ((REPLY, '"{colour:B} 2B {pixels}"'), "`{colour:B}` is not a layout", '"{colour:B} 2B {pixels}"'),
        ((REPLY, '"2B {mode:B} {pixels}"'), "put {mode:B} first", '"2B {mode:B} {pixels}"'),
        ((REPLY, f"{REPLY}, begins: [0]"), "leave `begins` out", REPLY),
        ((REPLY, "1603B"), "is not an image", "1603B"),
        (("    first: 3\n    width", "    width"), "write `first: 3`", "camera"),
        (("    first: 3\n    width", "    first: 2\n    width"), "write `first: 3`", "2"),
        (("read: image\n", "read: battery\n"), "is not an image", "H"),
        (("    read: image\n", ""), "name it under `read`", "image"),
        (("{mode:t}", "{left:t}"), "`{left:t}` is neither", f'"{PREPARE}"'.replace("{mode:t}", "{left:t}")),
        (("width: 40", "width: 400"), "are 16000 bytes, and it sends 3200 at most; 56 x 56 fits", "400"),
        (("chip: [640, 480]", "chip: [160, 240]"), "of the chip's 160 x 240; lower `zoom` to 4", "8"),
        (("chip: [640, 480]", "chip: [20, 20]"), "make them smaller", "8"),
        (("chip: [640, 480]", "chip: [640]"), "`chip` has too few entries; entry 2 is missing", "[640]"),
        (("chip: [640, 480]", "chip: [640, 480, 3]"), "too many entries; 2 at most", "[640, 480, 3]"),
        (("modes: {mono8: 0, rgb565: 1}", "modes: {rgb565: 1}"), "has no mono8; write rgb565", "mono8"),
        (("{mode:t}", "{mode:b}", "{mono8: 0, rgb565: 1}", "{mono8: 200}"), "a mode of 200", "{mono8: 200}"),
        (
            ("{width:t}", "{width:B}", SETTINGS, "width: 300\n    height: 4\n    zoom: 2"),
            "cannot hold a width of 300; write a larger place, like {width:H}",
            "300",
        ),
        (
            ("firmware_dead_man: false", "firmware_dead_man: false\nsettings: {camera: {zoom: 16}}"),
            "640 x 640 of the chip's 640 x 480; lower `zoom` to 12",
            "camera",
        ),
    ],
)  # fmt: skip
def test_a_camera_that_cannot_work_is_shown_where_it_is_wrong(tmp_path, change, message, pointed_at):
    text = own(tmp_path, *zip(change[::2], change[1::2], strict=True))
    [found] = load_catalog(tmp_path / "robots").diagnostics
    assert message in "; ".join(filter(None, (found.message, found.label, *found.help)))
    line = text.splitlines()[found.span.line - 1]
    assert line[found.span.column - 1 : found.span.end_column - 1] == pointed_at


@pytest.mark.parametrize("place", ["{width:B}", "{width:H}", "{width:i}"])
def test_a_camera_may_be_set_in_bytes(tmp_path, place):
    own(tmp_path, ("{width:t}", place))
    catalog = load_catalog(tmp_path / "robots")
    assert catalog.diagnostics == ()
    assert catalog.types["own"].sensors["camera"].prepare.send == PREPARE.replace("{width:t}", place)
