"""Exceptions, and diagnostics as data."""

from dataclasses import dataclass
from typing import NamedTuple


class Position(NamedTuple):
    """A position in a file: line and column from 1, and the byte from 0."""

    line: int
    column: int
    offset: int


class Span(NamedTuple):
    """A part of a file: the first position, and the one after the last."""

    file: str
    start: Position
    end: Position


class Edit(NamedTuple):
    """One replacement of text."""

    span: Span
    text: str


class Fix(NamedTuple):
    """A change that repairs the text; all of its edits belong together. A safe one needs no question."""

    title: str
    edits: list
    safe: bool


@dataclass(frozen=True)
class Diagnostic:
    """An error or a warning about a place in a source text."""

    code: str
    name: str
    severity: str
    message: str
    span: "Span | None"
    label: str
    labels: list
    notes: list
    help: "str | None"
    edits: list

    @classmethod
    def _made(cls, values):
        values["span"] = _span(values["span"])
        values["labels"] = [(_span(span), text) for span, text in values["labels"]]
        values["edits"] = [
            Fix(title, [Edit(_span(span), text) for span, text in edits], safe)
            for title, edits, safe in values["edits"]
        ]
        return cls(**values)


def _span(found):
    return found and Span(found[0], Position(*found[1]), Position(*found[2]))


class OslError(Exception):
    """An error; its text is that of the command line. `diagnostics` has it as data."""

    def __init__(self, text, diagnostics=(), span=None):
        super().__init__(text)
        self.diagnostics = list(diagnostics)
        self.span = _span(span)


class CompileError(OslError):
    """A source text has errors."""


class RequestError(OslError, ValueError):
    """The request makes no sense: an unknown name, or an array that does not fit."""


class RunError(OslError, RuntimeError):
    """A run reached one of its limits; `span` is the loop or call, if it is known."""


class Cancelled(OslError):
    """The run was cancelled."""
