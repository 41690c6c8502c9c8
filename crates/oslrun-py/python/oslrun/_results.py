"""Results: arrays by output, pictures and reports, as notebooks show them."""

import base64
import html
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from . import _native


class Message(NamedTuple):
    """What a shader says while it runs: `error` or `warning`, and the text."""

    severity: str
    text: str


class Outputs(dict):
    """Arrays by the name of the output, in the shape of the points. Also the messages and the printed text."""

    messages = ()
    printed = ""

    def png(self, name=None):
        """One output as a PNG file: a float as grey, a triple as the sRGB colors of linear values."""
        name = next(iter(self)) if name is None else name
        array = np.asarray(self[name], np.float32)
        planes = array[..., None] if array.ndim == 2 else array
        if planes.ndim != 3 or planes.shape[2] not in (1, 3):
            raise ValueError(f"`{name}` has the shape {array.shape}, which is no picture")
        parts = np.ascontiguousarray(np.moveaxis(planes, 2, 0)).reshape(planes.shape[2], -1)
        return _native.png(planes.shape[1], planes.shape[0], list(parts))

    def _repr_html_(self):
        shown = []
        for name, array in self.items():
            text = html.escape(f"{name}: {_summary(array)}")
            try:
                picture = base64.b64encode(self.png(name)).decode()
                shown.append(
                    f'<figure><img src="data:image/png;base64,{picture}"><figcaption>{text}</figcaption></figure>'
                )
            except (TypeError, ValueError):
                shown.append(f"<p>{text}</p>")
        return "".join(shown)


def _summary(array):
    if not isinstance(array, np.ndarray):
        return repr(array)
    if not array.size:
        return f"{array.dtype} {array.shape}"
    return f"{array.dtype} {array.shape}, {np.nanmin(array):g} to {np.nanmax(array):g}"


class Picture(bytes):
    """The bytes of a PNG file."""

    def _repr_png_(self):
        return bytes(self)


class Page(str):
    """The text of an HTML page."""

    def _repr_html_(self):
        return f'<iframe srcdoc="{html.escape(self)}" width="100%" height="600"></iframe>'


class Report(dict):
    """What the command reports, as data that `json.dumps` takes; `text` has it for people."""

    text = ""

    def __str__(self):
        return self.text

    def _repr_html_(self):
        return f"<pre>{html.escape(self.text)}</pre>"


@dataclass(frozen=True)
class Closure:
    """All components of one kind: for each, its point, its weight, and its parameters.

    `point` counts the points in the order of `ravel`. `params` has an array for each parameter of numbers, else a
    list; keyword parameters have their name, the others their number.
    """

    name: str
    point: np.ndarray
    weight: np.ndarray
    params: dict


class Closures(list):
    """The closures of an output: a `Closure` for each kind."""

    def __init__(self, output, kinds, shape):
        super().__init__(_closure(kind) for kind in kinds)
        self.output, self.shape = output, tuple(shape)

    def of(self, name):
        """The kinds with this name; there are several if a shader gives them different parameters."""
        return [closure for closure in self if closure.name == name]

    def weights(self):
        """The sum of the weights at each point."""
        total = np.zeros((int(np.prod(self.shape, dtype=int)), 3), np.float32)
        for closure in self:
            np.add.at(total, closure.point, closure.weight)
        return total.reshape(*self.shape, 3)


def _closure(kind):
    params = {}
    for at, (key, type_name, values, objects) in enumerate(kind["params"]):
        if not objects and len(values) == len(kind["point"]):
            value = values.astype(np.int32) if type_name == "int" else values
        else:
            value = objects or values.reshape(len(kind["point"]), -1)
        params[at if key is None else key] = value
    return Closure(kind["name"], kind["point"], kind["weight"], params)
