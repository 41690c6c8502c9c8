"""Equal bits: arrays, pictures, and the files that the command writes."""

import json

import numpy as np
import oslrun
import pytest
from conftest import REPAIRED, ROOT, SEEDS, same_bits
from oslrun._arrays import grid


@pytest.mark.parametrize("path", SEEDS, ids=lambda path: path.stem)
def test_arrays_have_the_bits_of_the_commands_grid(path):
    shader = oslrun.compile(path, repair=path in REPAIRED)
    for width, height in [(61, 47), (5, 3)]:
        picture = shader.image(width, height)
        arrays = shader(**grid(width, height))
        assert set(arrays) == set(picture) and picture
        for name, array in arrays.items():
            assert same_bits(array, picture[name]), f"{path.name} {name}"


@pytest.mark.parametrize("path", SEEDS, ids=lambda path: path.stem)
def test_pictures_are_the_files_of_the_command(path, command, tmp_path):
    shader = oslrun.compile(path, repair=path in REPAIRED)
    picture, repair = shader.image(40, 24), ["--repair"] * (path in REPAIRED)
    names = [name for name, array in picture.items() if array.dtype == np.float32 and array.ndim in (2, 3)]
    for name in names:
        file = tmp_path / f"{name}.png"
        code, _, errors = command(path, "--outputs", name, "-g", "40x24", "-o", file, *repair)
        assert code == 0, errors
    assert names
    report = json.loads(command(path, "-g", "40x24", "--json", *repair)[1])
    for output in report["outputs"]:
        array = picture[output["name"]] if output["name"] in picture else None
        if array is None or not np.isfinite(array).all():
            continue
        planes = np.moveaxis(array.reshape(24, 40, -1), -1, 0)
        for plane, component in zip(planes, output["components"]):
            assert (component["min"], component["max"]) == pytest.approx((plane.min(), plane.max()), abs=0)


def test_a_preview_is_the_file_of_the_command(command, tmp_path):
    file = tmp_path / "ball.png"
    assert command(ROOT / "osl/Cobbled.osl", "--preview", "-g", "32x32", "-p", "radius=0.3", "-o", file)[0] == 0
    made = oslrun.compile(ROOT / "osl/Cobbled.osl").preview(32, 32, radius=0.3)
    assert made == file.read_bytes() and made._repr_png_()[1:4] == b"PNG"


def test_reports_are_those_of_the_command(command):
    path = ROOT / "docs/questions/loop.osl"
    shader = oslrun.compile(path, repair=path in REPAIRED)
    explained = shader.explain(uv=(0.3, 0.7), grid=(64, 64))
    words = ["explain", path, "--uv", "0.3,0.7", "-g", "64x64"]
    assert explained == json.loads(command(*words, "--json")[1])
    assert explained.text == command(*words)[1].decode()
    json.dumps(explained)
    at = shader.explain(at=(3, 4), grid=(8, 8))
    assert "pixel (3, 4) of 8 by 8" in at.text
    stable = shader.stability(grid=(8, 8))
    assert json.dumps(stable) and stable.text in stable._repr_html_().replace("&gt;", ">").replace("&#x27;", "'")
    assert "<img" in shader.picture_book(grid=(8, 8)) or "<html" in shader.picture_book(grid=(8, 8))


def test_text_and_headers_have_the_tools_too():
    shader = oslrun.compile(
        source='#include "k.h"\nshader a(output float o = 0) { o = K * u; }', headers={"k.h": "#define K 2\n"}
    )
    assert shader.image(3, 1)["o"].tolist() == [[0, 1, 2]]
    assert "K * u" in shader.explain(at=(1, 0), grid=(3, 1)).text


def test_the_command_is_there(command):
    code, out, _ = command("--version")
    assert code == 0 and out.startswith(b"oslrun ")
    code, _, errors = command("no/such/file.osl")
    assert code == 1 and "no/such/file.osl" in errors
