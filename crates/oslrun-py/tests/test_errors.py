"""Errors as data and as the text of the command; interrupts."""

import os
import signal
import threading
import time

import numpy as np
import oslrun
import pytest
from conftest import ROOT

SLOW = "shader a(int n = 1000000, output float o = 0) { for (int i = 0; i < n; i++) o = noise(o * 7 + u); }"


def test_diagnostics_are_data():
    text = "shader a(float scale = 1, output float o = 0)\n{\n    o = u * scal;\n}\n"
    with pytest.raises(oslrun.CompileError) as caught:
        oslrun.compile(source=text, name="a.osl")
    error = caught.value
    first = error.diagnostics[0]
    assert (first.code, first.name, first.severity) == ("E0201", "unknown-name", "error")
    assert first.span.file == "a.osl" and first.span.start[:2] == (3, 13) and first.span.end.column == 17
    assert "scal" in first.message and text.encode()[first.span.start.offset : first.span.end.offset] == b"scal"
    (fix,) = first.edits
    assert fix.edits[0].text == "scale" and fix.edits[0].span.start.line == 3
    assert "a.osl:3:13" in str(error) and isinstance(error, oslrun.OslError)


@pytest.mark.parametrize("path", sorted((ROOT / "tests/data/reject").rglob("*.osl"))[:12], ids=lambda path: path.stem)
def test_the_text_is_that_of_the_command(path, command):
    name = path.relative_to(ROOT)
    with pytest.raises(oslrun.CompileError) as caught:
        before = os.getcwd()
        os.chdir(ROOT)
        try:
            oslrun.compile(name)
        finally:
            os.chdir(before)
    assert str(caught.value) == command(name)[2].strip()


def test_warnings_do_not_stop():
    shader = oslrun.compile(source="shader a(output float o = 0) { float unused = 1; o = u; }")
    assert [d.name for d in shader.warnings] == ["unused-variable"] and shader.warnings[0].severity == "warning"


def test_missing_files_and_headers():
    with pytest.raises(oslrun.OslError, match="no/such.osl"):
        oslrun.compile("no/such.osl")
    with pytest.raises(oslrun.CompileError, match="k.h"):
        oslrun.compile(source='#include "k.h"\nshader a() {}')
    with pytest.raises(TypeError):
        oslrun.compile()
    with pytest.raises(TypeError):
        oslrun.compile("a.osl", source="shader a() {}")
    for bad in (b"\x00", 3, ["a"]):
        with pytest.raises(TypeError):
            oslrun.compile(source=bad)
    with pytest.raises(oslrun.CompileError):
        oslrun.compile(source="")
    with pytest.raises(oslrun.CompileError):
        oslrun.compile(source="shader a() " + "{" * 100_000)


def test_include_folders(tmp_path):
    (tmp_path / "k.h").write_text("#define K 3\n")
    text = '#include "k.h"\nshader a(output float o = K) {}'
    assert oslrun.compile(source=text, include=[tmp_path])()["o"] == 3
    assert oslrun.compile(source=text, headers={"k.h": "#define K 4\n"}, include=tmp_path)()["o"] == 4
    file = tmp_path / "sub"
    file.mkdir()
    (file / "a.osl").write_text(text)
    assert oslrun.compile(file / "a.osl", include=[tmp_path])()["o"] == 3
    assert oslrun.compile(source="shader a(output float o = K) {}", define=["K=7"])()["o"] == 7
    with pytest.raises(oslrun.CompileError):
        oslrun.compile(source="shader a(output float o = 0) { o = 1;; } }", strict=True)


def test_what_a_shader_says():
    shader = oslrun.compile(
        source='shader a(output float o = 0) { if (u > 0.5) error("too %g", u); printf("%g ", u); o = u; }'
    )
    out = shader(u=[0.25, 1.0])
    assert out.printed == "0.25 1 " and out["o"].tolist() == [0.25, 1]
    (message,) = out.messages
    assert message.severity == "error" and "too 1" in message.text
    u = np.arange(64 * 64, dtype=np.float32).reshape(64, 64)
    assert shader(u=u).printed.split() == [f"{x:g}" for x in u.ravel()]


def test_a_loop_without_end_is_an_error():
    shader = oslrun.compile(source="shader a(output float o = 0) { while (1) o += u; }")
    with pytest.raises(oslrun.RunError) as caught:
        shader(u=[0.5])
    assert caught.value.span.start.line == 1


@pytest.mark.parametrize("points", [1, 100_000])
def test_ctrl_c_stops_a_run(points):
    shader = oslrun.compile(source=SLOW)
    u = np.linspace(0, 1, points, dtype=np.float32)
    timer = threading.Timer(0.4, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        while True:
            shader(u=u, n=200_000)
    assert time.monotonic() - began < 20
    timer.join()
    assert shader(u=[0.5], n=3)["o"].shape == (1,)


def test_two_threads_run_at_once():
    shader = oslrun.compile(ROOT / "osl/Cobbled.osl")
    p = np.random.default_rng(5).random((30_000, 3), np.float32)
    expected = {r: shader(P=p, radius=r, outputs="resultMask")["resultMask"] for r in (0.2, 0.4)}
    results = []

    def work(radius):
        for _ in range(5):
            results.append(
                np.array_equal(shader(P=p, radius=radius, outputs="resultMask")["resultMask"], expected[radius])
            )

    threads = [threading.Thread(target=work, args=(radius,)) for radius in (0.2, 0.4) for _ in range(2)]
    [thread.start() for thread in threads]
    [thread.join(120) for thread in threads]
    assert results == [True] * 20


def test_other_threads_of_python_go_on():
    shader = oslrun.compile(source=SLOW)
    ticks = []
    stop = threading.Event()

    def tick():
        while not stop.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    shader(u=np.linspace(0, 1, 20_000), n=3000)
    ended = time.monotonic()
    stop.set()
    thread.join()
    during = [t for t in ticks if began < t < ended]
    assert ended - began < 0.05 or len(during) >= (ended - began) / 0.01 / 20


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_has_threads_of_its_own():
    shader = oslrun.compile(source="shader a(output float o = 0) { o = noise(P); }")
    p = np.random.default_rng(6).random((50_000, 3), np.float32)
    expected = shader(P=p)["o"]
    child = os.fork()
    if child == 0:
        os._exit(0 if np.array_equal(shader(P=p)["o"], expected) else 1)
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            assert status == 0
            return
        time.sleep(0.05)
    os.kill(child, signal.SIGKILL)
    pytest.fail("the forked process hangs")
