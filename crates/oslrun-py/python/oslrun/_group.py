"""Groups: shaders as layers, with connections."""

from pathlib import Path

from . import _arrays, _native, _run
from ._errors import RequestError
from ._shader import _names, _program


class Group:
    """Shaders as layers, in order; the outputs are those of the last one, or `LAYER.OUTPUT`.

    `oslrun.Group().layer("noise", noise, scale=3).layer("paint", paint).connect("noise.out", "paint.x")`
    """

    def __init__(self, name=None, *, textures=None, folders=()):
        self._name, self._layers, self._connections, self._text = name, [], [], None
        self._renderer = _run.renderer(textures, [*map(Path, folders), Path()])
        self._programs = {}

    @classmethod
    def read(cls, text, *, shaders=None, folders=(), name="group", textures=None):
        """Reads a serialized group; shaders are texts by name, or files in folders."""
        group = cls(name, textures=textures, folders=folders)
        texts = {
            key: value.encode() if isinstance(value, str) else bytes(value) for key, value in (shaders or {}).items()
        }
        group._text = _native.Group.text((f"{name}.group", text), texts, [*map(Path, folders), Path()])
        return group

    def layer(self, name, shader, **params):
        """Adds a layer with values of its parameters, and returns the group."""
        if self._text is not None:
            raise RequestError("a group that was read takes no more layers")
        if any(name == other for other, *_ in self._layers):
            raise RequestError(f"there are two layers `{name}`")
        self._layers.append((name, shader, params))
        self._programs.clear()
        return self

    def connect(self, source, to):
        """Connects `LAYER.OUTPUT` to `LAYER.PARAMETER` of a later layer, and returns the group."""
        self._connections.append((source, to))
        self._programs.clear()
        return self

    def __call__(
        self, outputs=None, *, shape=None, userdata=None, services=None, threads=None, arithmetic="strict", **values
    ):
        """Runs the group: globals and parameters of the last layer by name; see `run`."""
        return self.run(
            values, outputs, shape=shape, userdata=userdata, services=services, threads=threads, arithmetic=arithmetic
        )

    def run(self, values, outputs=None, *, shape=None, userdata=None, services=None, threads=None, arithmetic="strict"):
        """Runs the group, as `Shader.run`; `LAYER.PARAMETER` is a parameter of any layer."""
        names = {f"{layer}.{param.name}" for layer, shader, _ in self._layers for param in shader.params}
        last = {param.name for param in self._layers[-1][1].params} if self._layers else set()
        own = {f"{layer}.{name}": value for layer, _, params in self._layers for name, value in params.items()}
        full = {f"{self._layers[-1][0]}.{name}" if name in last else name: value for name, value in values.items()}
        sorted_values = _run.Values({**own, **full}, userdata, self._shape_of, names)
        params = [name.partition(".")[2] for name in sorted_values.varying]
        if len(set(params)) < len(params):
            raise RequestError("parameters with one name in several layers cannot all have a value for each point")
        setting = {"shape": shape, "services": services, "threads": threads, "renderer": self._renderer}
        return _run.run(
            lambda *key: _program(self._programs, lambda: self._made(key[1]), arithmetic, *key),
            sorted_values,
            _names(outputs),
            setting,
        )

    def image(self, width=512, height=512, outputs=None, *, threads=None, **values):
        """The picture of the command for this group: the same points, with the same bits."""
        return self.run({**_arrays.grid(width, height), **values}, outputs, threads=threads)

    def _shape_of(self, path):
        layer, _, param = path.partition(".")
        found = next((shader for name, shader, _ in self._layers if name == layer), None)
        return found and found._native.shape_of(param)

    def _made(self, values):
        if self._text is not None:
            return self._text
        group = _native.Group(self._name)
        for layer, shader, _ in self._layers:

            def of(names, layer=layer):
                return [name for name in names if name.startswith(layer + ".")]

            constants = [(name.partition(".")[2], values.constants[name]) for name in of(values.constants)]
            group.layer(layer, shader._native, constants, [name.partition(".")[2] for name in of(values.varying)])
        for source, to in self._connections:
            group.connect(source, to)
        return group
