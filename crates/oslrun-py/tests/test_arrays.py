"""Arrays: broadcasting, parameters for each point, and everything that is no such array."""

import gc

import numpy as np
import oslrun
import pytest
from conftest import same_bits

TEXT = """
shader all(int n = 2, float k = 1, color c = 1, matrix m = 1, float list[3] = {1, 2, 3}, string name = "x",
           output float f = 0, output int i = 0, output color rgb = 0, output matrix o = 0, output float l[2] = {0, 0})
{
    f = k * u + list[1] + (name == "y");
    i = n * (int)(v * 100);
    rgb = c * noise(P * k);
    o = m * k;
    l[0] = u;
    l[1] = n;
}
"""


@pytest.fixture(scope="module")
def shader():
    return oslrun.compile(source=TEXT)


def test_shapes_and_types(shader):
    out = shader(u=np.zeros((4, 5)), v=np.zeros(5))
    shapes = {name: (array.shape, array.dtype.name) for name, array in out.items()}
    assert shapes == {
        "f": ((4, 5), "float32"),
        "i": ((4, 5), "int32"),
        "rgb": ((4, 5, 3), "float32"),
        "o": ((4, 5, 4, 4), "float32"),
        "l": ((4, 5, 2), "float32"),
    }
    assert shader()["f"].shape == () and shader(shape=(2, 3))["f"].shape == (2, 3)
    assert shader(u=np.zeros((0, 3)))["rgb"].shape == (0, 3, 3)
    assert list(shader(u=[1, 2], outputs="i")) == ["i"]


@pytest.mark.parametrize(
    "shapes", [((7, 1), (1, 9)), ((9,), (7, 9)), ((), (7, 9)), ((2, 1, 40), (3, 1)), ((70, 1), (1, 90))]
)
def test_broadcasting_is_that_of_numpy(shader, shapes):
    rng = np.random.default_rng(1)
    u, v = (rng.random(shape, np.float32) for shape in shapes)
    p = np.stack([u + 0 * v, v + 0 * u, 0 * (u + v)], -1)
    whole_u, whole_v = np.broadcast_arrays(u, v)
    out = shader(u=u, v=v, P=p)
    whole = shader(u=whole_u.copy(), v=whole_v.copy(), P=p)
    flat = shader(u=whole_u.ravel(), v=whole_v.ravel(), P=p.reshape(-1, 3))
    for name, array in out.items():
        assert same_bits(array, whole[name])
        assert same_bits(array.reshape(flat[name].shape), flat[name]), name


def test_parameters_for_each_point_are_those_of_single_runs(shader):
    rng = np.random.default_rng(2)
    count = 40
    point = {"u": rng.random(count), "v": rng.random(count), "P": rng.random((count, 3))}
    own = {
        "n": rng.integers(-5, 5, count),
        "k": rng.random(count),
        "c": rng.random((count, 3)),
        "m": rng.random((count, 4, 4)),
        "list": rng.random((count, 3)),
    }
    together = shader(**point, **own)
    for at in range(count):
        single = shader(**{name: array[at] for name, array in {**point, **own}.items()})
        for name, array in single.items():
            assert same_bits(together[name][at], array), (name, at)
    # Each parameter alone, and with points in two dimensions.
    for name, array in own.items():
        part = shader(**{k: np.asarray(a).reshape(5, 8, *np.shape(a)[1:]) for k, a in {**point, name: array}.items()})
        single = shader(**{k: np.asarray(a)[13] for k, a in {**point, name: array}.items()})
        assert all(same_bits(part[out][1, 5], single[out]) for out in single), name


def test_other_layouts_give_the_same_values(shader):
    u = np.linspace(0, 1, 64, dtype=np.float32)
    expected = shader(u=u)["f"]
    other = [
        u[::-1][::-1],
        np.repeat(u, 2)[::2],
        u.astype(np.float64),
        u.astype(">f4"),
        np.asfortranarray(u),
        list(u),
        memoryview(u),
    ]
    for array in other:
        assert same_bits(shader(u=array)["f"], expected)
    for array in other[:4]:
        array.flags.writeable = False
        assert same_bits(shader(u=array)["f"], expected)
    image = np.asfortranarray(np.tile(u, (64, 1)))
    assert same_bits(shader(u=image)["f"], np.tile(expected, (64, 1)))
    assert same_bits(shader(u=u.astype(np.float16))["f"], shader(u=u.astype(np.float16).astype(np.float32))["f"])
    ints = shader(u=np.arange(3), k=np.array([True, False, True]))
    assert ints["f"].tolist() == [2, 2, 4]


def test_values_that_stay_the_same(shader):
    assert shader(k=3, u=1, name="y", list=[1, 5, 3])["f"] == 9
    assert shader(c=[1, 2, 3], P=(1, 2, 3)).keys() == shader(c=2).keys()
    assert shader(n=np.int64(3), v=0.5)["i"] == 150
    assert shader(u=np.ones(3), n=np.array([2]))["l"].tolist() == [[1, 2]] * 3
    assert shader(n=np.array([2]))["i"].shape == (1,) and shader(n=np.int64(2))["i"].shape == ()
    struct = oslrun.compile(
        source="struct p { float a; color b; }; shader s(p q = {1, 2}, output color o = 0) { o = q.a * q.b; }"
    )
    assert struct(q={"a": 3})["o"].tolist() == [6, 6, 6] and struct(**{"q.b": (1, 2, 3)})["o"].tolist() == [1, 2, 3]
    with pytest.raises(oslrun.RequestError, match="field"):
        struct(**{"q.a": [1, 2]})
    image = oslrun.compile(source="shader a(output normal n = 0, output normal g = 0) { n = N; g = Ng; }")
    both = image(N=(0, 1, 0), shape=3)
    assert both["n"].tolist() == both["g"].tolist() == [[0, 1, 0]] * 3
    own = image(N=np.tile(np.float32([0, 1, 0]), (3, 1)), Ng=(1, 0, 0))
    assert own["g"].tolist() == [[1, 0, 0]] * 3 and own["n"].tolist() == [[0, 1, 0]] * 3


WRONG = [
    ({"u": np.zeros(3), "v": np.zeros(4)}, ValueError, "fit together: u"),
    ({"P": np.zeros((3, 2))}, ValueError, "P"),
    ({"P": np.zeros(4)}, ValueError, "P"),
    ({"u": np.zeros(3, complex)}, TypeError, "complex"),
    ({"u": "0.5"}, TypeError, "u"),
    ({"u": None}, TypeError, "u"),
    ({"u": np.array([object()])}, TypeError, "object"),
    ({"u": [[1, 2], [3]]}, ValueError, ""),
    ({"n": np.array([0.5, 1])}, TypeError, "ints"),
    ({"n": np.array([2**40, 1])}, ValueError, "32 bits"),
    ({"n": 2**40}, Exception, "n"),
    ({"n": "x"}, TypeError, "n"),
    ({"c": np.zeros((5, 2))}, ValueError, "c"),
    ({"c": [1, 2]}, TypeError, "c"),
    ({"m": np.zeros((5, 3))}, Exception, "m"),
    ({"name": np.array(["a", "b"])}, TypeError, "name"),
    ({"name": 3}, TypeError, "name"),
    ({"list": np.zeros((2, 4))}, ValueError, "list"),
    ({"radus": 1}, ValueError, "radus"),
    ({"kk": 1}, ValueError, "there is `k`"),
    ({"outputs": ["nothing"]}, ValueError, "nothing"),
    ({"outputs": [3]}, TypeError, ""),
    ({"shape": (-1,)}, Exception, ""),
    ({"shape": (2, 2), "u": np.zeros(3)}, ValueError, "fit together"),
    ({"arithmetic": "slow"}, ValueError, "slow"),
    ({"threads": -1}, Exception, ""),
    ({"services": 3, "threads": "x"}, TypeError, ""),
    ({"userdata": {"x": np.zeros((2, 5, 7))}}, ValueError, "x"),
]


@pytest.mark.parametrize("values, error, text", WRONG, ids=lambda value: str(value)[:40].replace("\n", " "))
def test_what_does_not_fit_is_an_error(shader, values, error, text):
    with pytest.raises(error) as caught:
        shader(**values)
    assert text in str(caught.value)


def test_points_that_fit_no_memory_are_an_error(shader):
    huge = np.broadcast_to(np.float32(0.5), (10**7, 10**7))
    with pytest.raises((MemoryError, ValueError)):
        shader(u=huge)
    with pytest.raises((MemoryError, ValueError, OverflowError)):
        shader(shape=(2**40, 2**40))


def test_arrays_are_not_kept(shader):
    gc.collect()
    u = np.zeros(100_000, np.float32)
    out = shader(u=u)
    import sys

    assert sys.getrefcount(u) == 2 and sys.getrefcount(out["f"]) <= 3


def test_contiguous_floats_are_not_copied(shader):
    from oslrun import _arrays

    u = np.zeros((64, 64), np.float32)
    assert np.shares_memory(_arrays.spread(_arrays.numbers("u", u), u.shape, ()), u)


def test_cheap_arithmetic_is_close():
    shader = oslrun.compile(source="shader a(output float o = 0) { o = sin(3 * u) * exp(v); }")
    u, v = np.random.default_rng(3).random((2, 1000), np.float32)
    strict, fast = (shader(u=u, v=v, arithmetic=kind)["o"] for kind in ("strict", "fast"))
    assert np.allclose(strict, fast, atol=1e-4) and np.isfinite(strict).all()
