"""Shaders: reads them, and runs them at arrays of points, on a grid, and under the tools of the command."""

import contextlib
import json
import os
import pickle
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import _native, _run
from ._errors import OslError, RequestError
from ._results import Message, Outputs, Page, Picture, Report


class Param(NamedTuple):
    """A parameter: `default` is `None` if code computes it."""

    name: str
    type: str
    output: bool
    default: object
    metadata: dict


def compile(
    path=None,
    *,
    source=None,
    name="shader.osl",
    headers=None,
    include=(),
    define=(),
    strict=False,
    repair=False,
    textures=None,
    folders=(),
):
    """Reads a shader from a file, or from the text `source`.

    `headers` are texts by name and `include` folders for `#include`; with a file, `headers` must be empty. `define` has
    macros, `NAME` or `NAME=VALUE`. `repair` inserts missing brackets of a file. `textures` are arrays or bytes of image
    files by name; other textures are files in the folder of the shader, in `folders`, or in the working directory.
    """
    if (path is None) == (source is None):
        raise TypeError("compile takes either a file or `source`")
    origin = _Origin(path and os.fspath(path), source, name, dict(headers or {}), include, define, strict, repair)
    return Shader(origin, textures, folders)


class _Origin:
    """Where a shader comes from."""

    def __init__(self, path, source, name, headers, include, define, strict, repair):
        self.path, self.source, self.name = path, source, name
        self.headers = {key: text.encode() if isinstance(text, str) else bytes(text) for key, text in headers.items()}
        self.include = [Path(folder) for folder in ([include] if isinstance(include, (str, Path)) else include)]
        self.define, self.strict, self.repair = list(define), strict, repair
        if path is not None and headers:
            raise TypeError("`headers` go with `source`; a file takes `include`")
        if source is not None and repair:
            raise TypeError("`repair` is for files")

    def read(self):
        if self.path is not None:
            return _native.Shader.file(Path(self.path), self.include, self.define, self.strict, self.repair)
        return _native.Shader.text((self.name, self.source), self.headers, self.include, self.define, self.strict)

    def texts(self):
        """The texts that take the place of files."""
        texts = {} if self.source is None else {**self.headers, self.name: self.source.encode()}
        return {Path(name): text.decode("utf-8", "surrogateescape") for name, text in texts.items()}

    @contextlib.contextmanager
    def file(self):
        """A file with the shader, as the tools of the command need it."""
        if self.path is not None:
            yield Path(self.path)
            return
        with tempfile.TemporaryDirectory(prefix="oslrun-") as folder:
            for name, text in self.texts().items():
                path = Path(folder, name)
                if not path.resolve().is_relative_to(Path(folder).resolve()):
                    raise RequestError(f"`{name}` is not a name below the folder of the shader")
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(text, encoding="utf-8", errors="surrogateescape")
            yield Path(folder, self.name)

    def options(self):
        """The same for the command line."""
        words = [word for folder in self.include for word in ("-I", str(folder))]
        words += [word for macro in self.define for word in ("-D", macro)]
        return words + ["--strict-syntax"] * self.strict + ["--repair"] * self.repair


class Shader:
    """A shader. Calling it runs it; see `run`."""

    def __init__(self, origin, textures=None, folders=()):
        self._origin, self._native = origin, origin.read()
        own = Path() if origin.path is None else Path(origin.path).parent
        self._renderer = _run.renderer(textures, [own, *map(Path, folders), Path()])
        self._programs = {}
        self.name, self.kind = self._native.name, self._native.kind
        self.params = tuple(Param(**param) for param in self._native.params)
        self.metadata, self.warnings = self._native.metadata, self._native.warnings

    def __repr__(self):
        return f"<{self.kind} {self.name}({', '.join(f'{p.type} {p.name}' for p in self.params if not p.output)})>"

    @property
    def outputs(self):
        """The names of the outputs."""
        return tuple(param.name for param in self.params if param.output)

    def __call__(
        self, outputs=None, *, shape=None, userdata=None, services=None, threads=None, arithmetic="strict", **values
    ):
        """Runs the shader: `shader(u=U, v=V, radius=0.3, outputs=["mask"])`; see `run`."""
        return self.run(
            values, outputs, shape=shape, userdata=userdata, services=services, threads=threads, arithmetic=arithmetic
        )

    def run(self, values, outputs=None, *, shape=None, userdata=None, services=None, threads=None, arithmetic="strict"):
        """Runs the shader at the points of arrays, on all cores, and returns arrays by the name of the output.

        `values` are parameters and globals by name. Arrays are broadcast, and give each point its value; other values
        are the same at all points. `shape` sets the shape of the points if no array has it. `userdata` are values by
        name for `getattribute`. `services` has methods `attribute(object, name)` and `transform(space)`, each asked once.
        """
        names = {param.name for param in self.params}
        sorted_values = _run.Values(values, userdata, self._native.shape_of, names)
        setting = {"shape": shape, "services": services, "threads": threads, "renderer": self._renderer}
        return _run.run(lambda *key: self._program(arithmetic, *key), sorted_values, _names(outputs), setting)

    def _program(self, arithmetic, outputs, values, lists, renderer):
        def make():
            group = _native.Group(None)
            group.layer(self.name, self._native, list(values.constants.items()), list(values.varying))
            return group

        return _program(self._programs, make, arithmetic, outputs, values, lists, renderer)

    def image(self, width=512, height=512, outputs=None, *, samples=None, threads=None, **params):
        """The picture of the command `oslrun FILE -g WIDTHxHEIGHT`: the same points, with the same bits."""
        origin = self._origin
        wanted = {
            "path": Path(origin.path or origin.name),
            "texts": origin.texts(),
            "include": origin.include,
            "define": origin.define,
            "strict": origin.strict,
            "repair": origin.repair,
            "threads": threads,
            "grid": (width, height),
            "samples": samples,
            "params": [(name, self._text(name, value)) for name, value in params.items()],
            "outputs": list(_names(outputs)) or None,
        }
        planes, messages, printed = _native.image(wanted)
        parts = {}
        for output, _, plane in planes:
            parts.setdefault(output, []).append(plane.reshape(height, width))
        results = Outputs((name, _joined(planes)) for name, planes in parts.items())
        results.messages = [Message("error" if error else "warning", text) for error, text in messages]
        results.printed = printed
        return results

    def preview(self, width=512, height=512, *, options=(), **params):
        """A lit ball, as of `oslrun FILE --preview`: the bytes of a PNG file."""
        words = ["--preview", "-g", f"{width}x{height}", "-o", "-", "--format", "png"]
        return Picture(self._command([], words, options, params)[0])

    def explain(self, at=None, uv=None, *, grid=(512, 512), options=(), **params):
        """Every value at a pixel, or at the point closest to some u and v, line by line."""
        words = ["--at", f"{at[0]},{at[1]}"] if at is not None else []
        words += ["--uv", f"{uv[0]},{uv[1]}"] if uv is not None else []
        return self._report("explain", [*words, "-g", f"{grid[0]}x{grid[1]}"], options, params)

    def stability(self, *, grid=(64, 64), options=(), **params):
        """The lines that lose digits."""
        return self._report("stability", ["-g", f"{grid[0]}x{grid[1]}"], options, params)

    def tradeoff(self, *, grid=(64, 64), options=(), **params):
        """Cost and error of each setting."""
        return self._report("tradeoff", ["-g", f"{grid[0]}x{grid[1]}"], options, params)

    def picture_book(self, *, grid=(128, 128), options=(), **params):
        """The source, with a picture beside each line, as an HTML page."""
        with tempfile.TemporaryDirectory(prefix="oslrun-") as folder:
            book = Path(folder, "book.html")
            self._command(["picture-book"], ["-g", f"{grid[0]}x{grid[1]}", "-o", str(book)], options, params)
            return Page(book.read_text(encoding="utf-8"))

    def _report(self, name, words, options, params):
        report = Report(json.loads(self._command([name], [*words, "--json"], options, params)[0]))
        report.text = self._command([name], words, options, params)[0].decode()
        return report

    def _command(self, name, words, options, params):
        values = [word for key, value in params.items() for word in ("-p", f"{key}={self._text(key, value)}")]
        with self._origin.file() as path:
            code, out, err = _native.command([*name, str(path), *words, *values, *self._origin.options(), *options])
        if code:
            raise (RequestError if code == 2 else OslError)(err.strip())
        return out, err

    def _text(self, name, value):
        """A value as the command line takes it."""
        if isinstance(value, str):
            return value
        param = next((param for param in self.params if param.name == name.split(".")[0]), None)
        flat = np.asarray(value).reshape(-1)
        if param is not None and param.type.startswith("int"):
            return ",".join(str(int(x)) for x in flat)
        # The shortest text of the 32-bit value, which is read back to its bits.
        return ",".join(repr(float(np.float32(x))) for x in flat)


def _names(outputs):
    return () if outputs is None else (outputs,) if isinstance(outputs, str) else tuple(outputs)


def _joined(planes):
    size = len(planes)
    if size == 1:
        return planes[0]
    stacked = np.stack(planes, -1)
    return stacked.reshape(*stacked.shape[:-1], 4, 4) if size == 16 else stacked


def _program(kept, make, arithmetic, outputs, values, lists, renderer):
    """A program for these outputs, constants, varying names and spaces: a kept one, or that of a group of `make`."""
    if arithmetic not in ("strict", "fast"):
        raise RequestError(f"there is no arithmetic `{arithmetic}`: strict or fast")
    key = (arithmetic, outputs, tuple(values.varying), lists, renderer is None, pickle.dumps(values.constants))
    program = kept.pop(key, None) or make().compile(list(outputs), list(lists), arithmetic == "fast", renderer)
    kept[key] = program
    if len(kept) > _run.KEPT:
        kept.pop(next(iter(kept)), None)
    return program
