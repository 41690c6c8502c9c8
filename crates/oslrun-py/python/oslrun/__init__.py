"""Open Shading Language on the CPU: arrays in, arrays out.

`compile` reads a shader, calling it runs it at the points of arrays, and `Group` connects several shaders.
"""

from ._errors import Cancelled, CompileError, Diagnostic, Edit, Fix, OslError, Position, RequestError, RunError, Span
from ._group import Group
from ._results import Closure, Closures, Message, Outputs, Page, Picture, Report
from ._shader import Param, Shader, compile

__all__ = [
    "Cancelled",
    "Closure",
    "Closures",
    "CompileError",
    "Diagnostic",
    "Edit",
    "Fix",
    "Group",
    "Message",
    "OslError",
    "Outputs",
    "Page",
    "Param",
    "Picture",
    "Position",
    "Report",
    "RequestError",
    "RunError",
    "Shader",
    "Span",
    "compile",
]
__version__ = "0.1.0"
