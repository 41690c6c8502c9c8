"""Runs: sorts values by what they are for, and calls the native part with arrays."""

import difflib

import numpy as np

from . import _arrays, _native
from ._arrays import GLOBALS, P_DERIVS, UV_DERIVS, broadcast, leading, numbers, spread
from ._errors import RequestError
from ._results import Closures, Message, Outputs

#: The number of programs that a shader keeps: one for each set of outputs, constants and varying globals.
KEPT = 16


class Values:
    """Values of a call, sorted: those of parameters, of globals, and of names that shaders ask for."""

    def __init__(self, values, userdata, shape_of, names):
        self.constants, self.varying, self.lists, self.same, self.data = {}, {}, {}, {}, {}
        self.shapes = {}
        for name, value in values.items():
            # A name may be that of a field of a struct.
            if name in names or any(name.startswith(known + ".") for known in names):
                self._param(name, value, shape_of(name))
                if name in self.varying and name not in names:
                    raise RequestError(f"`{name}` is a field of a struct, which has one value for all points")
            elif name in GLOBALS:
                self._global(name, value)
            elif name in ("s", "t"):
                self.data[name] = value
                self.shapes[name] = np.shape(value)
            else:
                close = difflib.get_close_matches(name, [*names, *GLOBALS, "s", "t"], 1)
                hint = f"; there is `{close[0]}`" if close else "; data for `getattribute` go in `userdata`"
                raise RequestError(f"there is no parameter or global `{name}`{hint}")
        self.data.update(userdata or {})

    def _param(self, name, value, shape):
        if shape is not None and not np.isscalar(value):
            kind, own = shape
            array = np.asarray(value)
            # A triple may be given as one number, an array as a shorter one.
            if array.ndim > len(own) or array.ndim == len(own) == 0:
                array = numbers(name, value, kind)
                self.shapes[name] = leading(name, array, own)
                if array.size != np.prod(own, dtype=int) or array.size == 0:
                    self.varying[name] = (array, kind, own)
                    return
                value = array.reshape(own)
        self.constants[name] = value

    def _global(self, name, value):
        array, own = numbers(name, value), GLOBALS[name]
        if own and array.ndim == 0:
            array = np.broadcast_to(array, own)
        axes = leading(name, array, own)
        # One value is the same at all points, if no derivative belongs to it.
        if not axes and name not in UV_DERIVS and name not in P_DERIVS:
            self.same[name] = array.reshape(-1).tolist() + [0.0] * (2 if not own else 0)
            return
        self.lists[name], self.shapes[name] = array, axes

    def prepared(self, shape):
        """Lists and named data for points of this shape, in the form of the native part."""
        lists = {name: spread(array, shape, GLOBALS[name]) for name, array in self.lists.items()}
        if any(name in lists for name in UV_DERIVS):
            zero = np.zeros(shape, np.float32)
            parts = [lists.pop(name, zero) for name in UV_DERIVS]
            lists["uv_derivs"] = np.stack(parts, -1)
        if any(name in lists for name in P_DERIVS):
            for name in P_DERIVS:
                lists.setdefault(name, np.zeros((*shape, 3), np.float32))
        named = []
        for name, (array, kind, own) in self.varying.items():
            size = {"triple": 1, "matrix": 2}.get(kind, 0)
            length = own[0] if len(own) > size else None
            named.append((name.rpartition(".")[2], kind, length, spread(array, shape, own)))
        for name, value in self.data.items():
            array = value if isinstance(value, str) else np.asarray(value)
            if name in ("s", "t"):
                array = spread(numbers(name, array), shape, ())
            named.append((name, *_with_length(_arrays.classified(name, array, shape))))
        return list(lists.items()), list(self.same.items()), named


def _with_length(found):
    return found[0], None, found[1]


def run(native, values, outputs, setting):
    """Runs a program at the points of sorted values. `native` makes it for names of outputs and sorted values."""
    shape = setting["shape"]
    if shape is not None:
        shape = {"shape": (int(shape),) if np.ndim(shape) == 0 else tuple(map(int, shape))}
    shape = broadcast({**values.shapes, **(shape or {})})
    lists, same, named = values.prepared(shape)
    # Services that know spaces may answer otherwise in the next run.
    known = None if hasattr(setting["services"], "transform") else setting["renderer"]
    program = native(tuple(outputs), values, tuple(name for name, _ in lists), known)
    arrays = {name: np.empty((*shape, *own), np.int32 if ints else np.float32) for name, ints, own in program.outputs()}
    closures = [name for name in outputs if name not in arrays]
    setting = _Setting(setting["renderer"], setting["services"], list(shape), setting["threads"], closures)
    messages, printed, found = program.run(lists, same, named, list(arrays.values()), setting)
    results = Outputs(arrays)
    results.update((name, Closures(name, kinds, shape)) for name, kinds in found)
    results.messages = [Message("error" if error else "warning", text) for error, text in messages]
    results.printed = printed
    return results


class _Setting:
    def __init__(self, renderer, services, shape, threads, closures):
        self.renderer, self.services, self.shape = renderer, services, shape
        self.threads, self.closures = threads, closures


def renderer(textures, folders):
    """A renderer with textures: arrays by name, row 0 on top, or the bytes of image files."""
    files = {}
    for name, texture in (textures or {}).items():
        if isinstance(texture, (bytes, bytearray)):
            files[name] = bytes(texture)
            continue
        array = numbers(name, texture)
        array = array[..., None] if array.ndim == 2 else array
        if array.ndim != 3 or array.shape[2] not in (1, 3, 4) or not array.size:
            raise RequestError(
                f"texture `{name}` has the shape {array.shape}, not rows, columns and 1, 3 or 4 channels"
            )
        planes = np.ascontiguousarray(np.moveaxis(array, 2, 0)).reshape(array.shape[2], -1)
        files[name] = _native.texture(array.shape[1], array.shape[0], list(planes))
    return _native.Renderer(files, folders)
