"""Arrays: which axes are points, and how the native part gets them."""

import numpy as np

from ._errors import RequestError

FLOATS = ("u", "v", "time", "dtime", "surfacearea", "backfacing")
TRIPLES = ("P", "N", "Ng", "I", "dPdu", "dPdv", "Ps", "dPdtime")
UV_DERIVS = ("dudx", "dudy", "dvdx", "dvdy")
P_DERIVS = ("dPdx", "dPdy")
GLOBALS = {**dict.fromkeys(FLOATS + UV_DERIVS, ()), **dict.fromkeys(TRIPLES + P_DERIVS, (3,))}


def numbers(name, value, kind="float"):
    """The value as an array of 32-bit floats or ints; not copied if it is one."""
    array = np.asarray(value)
    if array.dtype.kind not in ("biu" if kind == "int" else "biuf"):
        raise TypeError(f"`{name}` takes {'ints' if kind == 'int' else 'real numbers'}, not {array.dtype}")
    if kind != "int":
        return array.astype(np.float32, copy=False)
    if array.dtype != np.int32 and array.size and (array.min() < -(2**31) or array.max() >= 2**31):
        raise RequestError(f"`{name}` has ints of more than 32 bits")
    return array.astype(np.int32, copy=False)


def leading(name, array, shape):
    """The axes before those of one value of this shape."""
    axes = array.ndim - len(shape)
    if axes < 0 or array.shape[axes:] != tuple(shape):
        raise RequestError(f"`{name}` has the shape {array.shape}, and a value of it has the shape {tuple(shape)}")
    return array.shape[:axes]


def spread(array, shape, own):
    """The array with a value for each point, in one piece."""
    return np.ascontiguousarray(np.broadcast_to(array, tuple(shape) + tuple(own)))


def broadcast(shapes):
    """The shape of the points of arrays: names with the axes of each."""
    try:
        return np.broadcast_shapes(*shapes.values())
    except ValueError:
        listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise RequestError(f"the points of the arrays do not fit together: {listed}") from None


def answer(services, obj, name, shape):
    """What services answer to `getattribute`: nothing, or its kind and one value or one for each point."""
    ask = getattr(services, "attribute", None)
    value = ask(obj, name) if ask else None
    return None if value is None else classified(name, value, tuple(shape))


def classified(name, value, shape):
    """A value with its kind; one for each point if it is an array that begins with the axes of the points."""
    if isinstance(value, str):
        return "same-string", value
    array = np.asarray(value)
    array = numbers(name, array, "int" if array.dtype.kind in "biu" else "float")
    is_int = array.dtype == np.int32
    each = bool(shape) and array.shape[: len(shape)] == shape
    own = array.shape[len(shape) :] if each else array.shape
    kinds = {(): "int" if is_int else "float", (3,): "triple", (4, 4): "matrix"}
    if own not in kinds:
        if each or array.ndim != 1:
            raise RequestError(f"`{name}` has the shape {array.shape}: a value is a number, 3 numbers or 4 by 4")
        return ("same-ints" if is_int else "same-floats"), array.tolist()
    if is_int and own:
        array = array.astype(np.float32)
    if each:
        return kinds[own], np.ascontiguousarray(array)
    return "same-" + kinds[own], array.tolist()


def space(services, name):
    """The matrix of a space from services."""
    ask = getattr(services, "transform", None)
    matrix = ask(name) if ask else None
    return None if matrix is None else np.asarray(matrix, np.float32).reshape(16).tolist()


def grid(width, height):
    """The globals of the command's grid, with their derivatives."""

    def axis(n):
        return np.full(1, 0.5, np.float32) if n == 1 else np.arange(n, dtype=np.float32) / np.float32(n - 1)

    u, v = np.broadcast_arrays(axis(width)[None, :], axis(height)[:, None])
    dx, dy = (np.float32(1) / np.float32(max(n - 1, 1)) for n in (width, height))
    point = {"u": u, "v": v, "P": np.stack([u, v, np.ones_like(u)], -1), "s": u, "t": v, "surfacearea": 1}
    point.update(N=(0, 0, 1), Ng=(0, 0, 1), I=(0, 0, -1))
    return {**point, "dudx": dx, "dvdy": dy, "dPdx": (dx, 0, 0), "dPdy": (0, dy, 0)}
