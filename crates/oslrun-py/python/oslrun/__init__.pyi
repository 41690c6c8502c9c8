import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import numpy.typing as npt
from typing_extensions import TypeAlias

Path: TypeAlias = str | os.PathLike[str]
Value: TypeAlias = npt.ArrayLike | str | Sequence[str] | Mapping[str, Any]
Texture: TypeAlias = npt.ArrayLike | bytes

class Services(Protocol):
    """Methods that a renderer may have; each is asked once a run for each name."""
    def attribute(self, object: str, name: str, /) -> npt.ArrayLike | str | None: ...
    def transform(self, space: str, /) -> npt.ArrayLike | None: ...

class Position(NamedTuple):
    line: int
    column: int
    offset: int

class Span(NamedTuple):
    file: str
    start: Position
    end: Position

class Edit(NamedTuple):
    span: Span
    text: str

class Fix(NamedTuple):
    title: str
    edits: list[Edit]
    safe: bool

@dataclass(frozen=True)
class Diagnostic:
    code: str
    name: str
    severity: str
    message: str
    span: Span | None
    label: str
    labels: list[tuple[Span | None, str]]
    notes: list[str]
    help: str | None
    edits: list[Fix]

class OslError(Exception):
    diagnostics: list[Diagnostic]
    span: Span | None

class CompileError(OslError): ...
class RequestError(OslError, ValueError): ...
class RunError(OslError, RuntimeError): ...
class Cancelled(OslError): ...

class Message(NamedTuple):
    severity: str
    text: str

class Outputs(dict[str, Any]):
    messages: list[Message]
    printed: str
    def png(self, name: str | None = None) -> bytes: ...

class Picture(bytes): ...
class Page(str): ...

class Report(dict[str, Any]):
    text: str

@dataclass(frozen=True)
class Closure:
    name: str
    point: npt.NDArray[np.int64]
    weight: npt.NDArray[np.float32]
    params: dict[int | str, Any]

class Closures(list[Closure]):
    output: str
    shape: tuple[int, ...]
    def of(self, name: str) -> list[Closure]: ...
    def weights(self) -> npt.NDArray[np.float32]: ...

class Param(NamedTuple):
    name: str
    type: str
    output: bool
    default: Any
    metadata: dict[str, Any]

class Shader:
    name: str
    kind: str
    params: tuple[Param, ...]
    metadata: dict[str, Any]
    warnings: list[Diagnostic]
    @property
    def outputs(self) -> tuple[str, ...]: ...
    def __call__(
        self,
        outputs: str | Iterable[str] | None = None,
        *,
        shape: int | Sequence[int] | None = None,
        userdata: Mapping[str, Value] | None = None,
        services: Services | None = None,
        threads: int | None = None,
        arithmetic: str = "strict",
        **values: Value,
    ) -> Outputs: ...
    def run(
        self,
        values: Mapping[str, Value],
        outputs: str | Iterable[str] | None = None,
        *,
        shape: int | Sequence[int] | None = None,
        userdata: Mapping[str, Value] | None = None,
        services: Services | None = None,
        threads: int | None = None,
        arithmetic: str = "strict",
    ) -> Outputs: ...
    def image(
        self,
        width: int = 512,
        height: int = 512,
        outputs: str | Iterable[str] | None = None,
        *,
        samples: int | None = None,
        threads: int | None = None,
        **params: Value,
    ) -> Outputs: ...
    def preview(
        self, width: int = 512, height: int = 512, *, options: Sequence[str] = (), **params: Value
    ) -> Picture: ...
    def explain(
        self,
        at: tuple[int, int] | None = None,
        uv: tuple[float, float] | None = None,
        *,
        grid: tuple[int, int] = (512, 512),
        options: Sequence[str] = (),
        **params: Value,
    ) -> Report: ...
    def stability(
        self, *, grid: tuple[int, int] = (64, 64), options: Sequence[str] = (), **params: Value
    ) -> Report: ...
    def tradeoff(self, *, grid: tuple[int, int] = (64, 64), options: Sequence[str] = (), **params: Value) -> Report: ...
    def picture_book(
        self, *, grid: tuple[int, int] = (128, 128), options: Sequence[str] = (), **params: Value
    ) -> Page: ...

class Group:
    def __init__(
        self, name: str | None = None, *, textures: Mapping[str, Texture] | None = None, folders: Iterable[Path] = ()
    ) -> None: ...
    @classmethod
    def read(
        cls,
        text: str,
        *,
        shaders: Mapping[str, str | bytes] | None = None,
        folders: Iterable[Path] = (),
        name: str = "group",
        textures: Mapping[str, Texture] | None = None,
    ) -> Group: ...
    def layer(self, name: str, shader: Shader, **params: Value) -> Group: ...
    def connect(self, source: str, to: str) -> Group: ...
    def __call__(
        self,
        outputs: str | Iterable[str] | None = None,
        *,
        shape: int | Sequence[int] | None = None,
        userdata: Mapping[str, Value] | None = None,
        services: Services | None = None,
        threads: int | None = None,
        arithmetic: str = "strict",
        **values: Value,
    ) -> Outputs: ...
    def run(
        self,
        values: Mapping[str, Value],
        outputs: str | Iterable[str] | None = None,
        *,
        shape: int | Sequence[int] | None = None,
        userdata: Mapping[str, Value] | None = None,
        services: Services | None = None,
        threads: int | None = None,
        arithmetic: str = "strict",
    ) -> Outputs: ...
    def image(
        self,
        width: int = 512,
        height: int = 512,
        outputs: str | Iterable[str] | None = None,
        *,
        threads: int | None = None,
        **values: Value,
    ) -> Outputs: ...

def compile(
    path: Path | None = None,
    *,
    source: str | None = None,
    name: str = "shader.osl",
    headers: Mapping[str, str | bytes] | None = None,
    include: Path | Iterable[Path] = (),
    define: Iterable[str] = (),
    strict: bool = False,
    repair: bool = False,
    textures: Mapping[str, Texture] | None = None,
    folders: Iterable[Path] = (),
) -> Shader: ...
