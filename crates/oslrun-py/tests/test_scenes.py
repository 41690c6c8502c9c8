"""Groups, textures, services of a renderer, data of points, and closures."""

import json

import numpy as np
import oslrun
import pytest
from conftest import ROOT, same_bits

SCALE = "shader scale(float by = 1, float add = 0, output float o = 0) { o = by * u + add; }"
PAINT = (
    "shader paint(float x = 0, float add = 0, output color c = 0) { c = mix(color(1, 0, 0), color(0, 0, 1), x) + add; }"
)


def group():
    scale, paint = oslrun.compile(source=SCALE), oslrun.compile(source=PAINT)
    return oslrun.Group().layer("scale", scale, by=0.5).layer("paint", paint).connect("scale.o", "paint.x")


def test_groups():
    net = group()
    assert net(u=[0, 1, 2])["c"].tolist() == [[1, 0, 0], [0.5, 0, 0.5], [0, 0, 1]]
    assert net.run({"u": [1, 1], "scale.by": [0.0, 1.0]})["c"].tolist() == [[1, 0, 0], [0, 0, 1]]
    out = net(u=2, add=1, outputs=["c", "scale.o"])
    assert out["c"].tolist() == [1, 1, 2] and out["scale.o"] == 1
    assert net(u=2, add=np.array([0.0, 1.0]))["c"].tolist() == [[0, 0, 1], [1, 1, 2]]
    with pytest.raises(oslrun.RequestError, match="several layers"):
        net.run({"scale.add": [0, 1], "paint.add": [1, 2]})
    with pytest.raises(oslrun.RequestError, match="nothing"):
        net.run({"scale.nothing": 1})
    with pytest.raises(oslrun.RequestError, match="two layers"):
        net.layer("paint", oslrun.compile(source=PAINT))
    with pytest.raises(oslrun.OslError):
        group().connect("scale.o", "paint.none")(u=1)
    with pytest.raises(oslrun.OslError):
        oslrun.Group()(u=1)


def test_groups_as_text():
    text = "param float by 0.5; shader scale s; shader paint p; connect s.o p.x;"
    net = oslrun.Group.read(text, shaders={"scale.osl": SCALE, "paint.osl": PAINT})
    assert same_bits(net(u=[0, 1, 2])["c"], group()(u=[0, 1, 2])["c"])
    stones = (ROOT / "examples/networks/cobbled_3.group").read_text()
    out = oslrun.Group.read(stones, folders=[ROOT / "osl"])(P=np.random.default_rng(1).random((9, 3)))
    assert out and all(len(array) == 9 for array in out.values())
    with pytest.raises(oslrun.CompileError, match="scale"):
        oslrun.Group.read(text)


def test_pictures_of_groups_are_those_of_the_command(command):
    net = group()
    assert net.image(5, 3)["c"][2].tolist() == net(u=[0, 0.25, 0.5, 0.75, 1])["c"].tolist()
    file = ROOT / "examples/networks/cobbled_3.group"
    picture = oslrun.Group.read(file.read_text(), folders=[ROOT / "osl"]).image(40, 30)
    words = [file, "--shader-path", ROOT / "osl", "-g", "40x30", "--json"]
    outputs = json.loads(command(*words)[1])["outputs"]
    assert [output["name"] for output in outputs] == list(picture)
    for output in outputs:
        planes = np.moveaxis(picture[output["name"]].reshape(30 * 40, -1), -1, 0)
        for plane, component in zip(planes, output["components"]):
            assert (component["min"], component["max"]) == (plane.min(), plane.max())


def test_textures_are_arrays():
    text = 'shader a(string file = "t.exr", output color o = 0) { o = texture(file, u, v, "interp", "closest"); }'
    rng = np.random.default_rng(7)
    u, v = (np.arange(8) + 0.5) / 8, ((np.arange(4) + 0.5) / 4)[:, None]
    for channels, shape in [(3, (4, 8, 3)), (1, (4, 8)), (1, (4, 8, 1)), (4, (4, 8, 4))]:
        texture = rng.random(shape, np.float32)
        shader = oslrun.compile(source=text, textures={"t.exr": texture})
        out = shader(u=u, v=v)
        color = texture.reshape(4, 8, channels)
        expected = color[..., :3] if channels >= 3 else np.concatenate([color, np.zeros((4, 8, 2), np.float32)], -1)
        assert not out.messages and np.allclose(out["o"], expected), (shape, out["o"][0, 0], expected[0, 0])
    missing = oslrun.compile(source=text)(u=0.5, v=0.5)
    assert any("t.exr" in message.text for message in missing.messages)
    for wrong in (np.zeros((2, 2, 2)), np.zeros(4), np.zeros((0, 4)), "x"):
        with pytest.raises((ValueError, TypeError)):
            oslrun.compile(source=text, textures={"t.exr": wrong})


def test_textures_are_files_in_folders(tmp_path):
    text = 'shader a(string file = "t.png", output color o = 0) { o = texture(file, u, v, "interp", "closest"); }'
    (tmp_path / "t.png").write_bytes(oslrun.Outputs(o=np.full((4, 4), 1.0)).png())
    inside = oslrun.compile(source=text, folders=[tmp_path])
    assert inside(u=0.5, v=0.5)["o"][0] == 1 and inside(u=0.5, v=0.5, file=str(tmp_path / "t.png"))["o"][0] == 1
    outside = oslrun.compile(source=text)(u=0.5, v=0.5, file=str(tmp_path / "t.png"))
    assert outside.messages and outside["o"][0] == 0
    (tmp_path / "a.osl").write_text(text)
    assert oslrun.compile(tmp_path / "a.osl")(u=0.5, v=0.5)["o"][0] == 1


class Scene:
    """Services that count how often they are asked."""

    def __init__(self):
        self.asked = []

    def attribute(self, obj, name):
        self.asked.append((obj, name))
        answers = {
            "id": np.arange(6, dtype=np.int32).reshape(2, 3),
            "tint": np.arange(18.0).reshape(2, 3, 3),
            "label": "trunk",
            "fov": 35.0,
            "weights": [1.0, 2.0, 4.0, 8.0],
        }
        return answers.get(name)

    def transform(self, space):
        self.asked.append(space)
        return np.diag([2, 2, 2, 1]) if space == "trunk" else None


ASKS = """
shader a(output int i = -1, output color c = 0, output float f = 0, output float w = 0, output int known = 0, output point p = 0)
{
    string name = "";
    float list[4] = {0, 0, 0, 0};
    getattribute("id", i);
    getattribute("tint", c);
    known = getattribute("label", name) + 10 * getattribute("none", f) + 100 * (name == "trunk");
    getattribute("camera", "fov", f);
    getattribute("weights", list);
    w = list[3];
    p = transform("trunk", "common", P);
}
"""


def test_services_are_asked_once():
    shader, scene = oslrun.compile(source=ASKS), Scene()
    out = shader(services=scene, shape=(2, 3), P=(1, 2, 3))
    assert out["i"].tolist() == [[0, 1, 2], [3, 4, 5]] and np.array_equal(out["c"].ravel(), np.arange(18))
    assert (out["f"] == 35).all() and (out["w"] == 8).all() and (out["known"] == 101).all()
    assert out["p"][0, 0].tolist() == [2, 4, 6]
    assert len(scene.asked) == len(set(scene.asked)) and ("camera", "fov") in scene.asked
    with pytest.raises(oslrun.RequestError, match="id"):
        shader(services=scene, u=np.zeros((64, 64)))
    image = np.random.default_rng(8).random((64, 96, 3), np.float32)
    tinted = shader(userdata={"tint": image}, u=np.zeros((64, 96)))
    assert same_bits(tinted["c"], image)


def test_exceptions_of_services_come_back():
    class Broken:
        def attribute(self, obj, name):
            raise LookupError("no " + name)

    with pytest.raises(LookupError, match="no id"):
        oslrun.compile(source=ASKS)(services=Broken(), u=np.zeros(10_000))

    class Wrong:
        def attribute(self, obj, name):
            return object()

    with pytest.raises(TypeError):
        oslrun.compile(source=ASKS)(services=Wrong(), u=np.zeros(10))


def test_services_may_run_shaders():
    inner = oslrun.compile(source="shader b(output float o = 0) { o = 2 * u; }")

    class Nested:
        def attribute(self, obj, name):
            return inner(u=np.arange(6.0))["o"] if name == "f" else None

    outer = oslrun.compile(source='shader a(output float o = 0) { getattribute("f", o); }')
    assert outer(services=Nested(), shape=6)["o"].tolist() == [0, 2, 4, 6, 8, 10]


def test_data_of_points():
    shader = oslrun.compile(
        source='shader a(output float o = 0, output float q = 0) { getattribute("s", o); getattribute("heat", q); }'
    )
    out = shader(s=[1, 2], userdata={"heat": np.float32([5, 6])})
    assert out["o"].tolist() == [1, 2] and out["q"].tolist() == [5, 6]


def test_closures_are_arrays():
    text = """surface a() {
        Ci = u * diffuse(N) + emission();
        if (v > 0.5) Ci += 0.5 * phong(N, 10 * u);
    }"""
    u = np.linspace(0, 1, 300, dtype=np.float32).reshape(3, 100)
    v = np.float32([[0], [1], [0]])
    closures = oslrun.compile(source=text)(u=u, v=v, outputs="Ci")["Ci"]
    (diffuse,), (emission,), (phong,) = (closures.of(name) for name in ("diffuse", "emission", "phong"))
    assert np.array_equal(diffuse.weight[:, 1], u.ravel()[diffuse.point])
    assert emission.point.tolist() == list(range(300))
    assert phong.point.tolist() == list(range(100, 200)) and np.allclose(phong.params[1], 10 * u[1])
    assert phong.params[0].shape == (100, 3)
    expected = 1 + u + 0.5 * (v > 0.5)
    assert closures.weights().shape == (3, 100, 3) and np.allclose(closures.weights()[..., 0], expected)
    none = oslrun.compile(source=text)(u=np.zeros(0), outputs=["Ci"])["Ci"]
    assert none.weights().shape == (0, 3)


def test_notebooks_show_results():
    shader = oslrun.compile(source="shader a(output float o = 0, output color c = 0) { o = u; c = color(u, v, 0); }")
    out = shader.image(16, 8)
    assert out._repr_html_().count("<img") == 2 and out.png("o")[1:4] == b"PNG"
    assert "<img" not in shader(u=[1, 2], outputs="o")._repr_html_()
    with pytest.raises(ValueError):
        shader(u=[1, 2]).png("o")
