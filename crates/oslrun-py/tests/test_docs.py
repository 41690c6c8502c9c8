"""The pages about the package: every example runs."""

import doctest
import os

import numpy as np
import pytest
from conftest import ROOT


@pytest.mark.parametrize("page", ["crates/oslrun-py/README.md", "docs/python.md"])
def test_examples_run(page):
    before = os.getcwd()
    os.chdir(ROOT)
    np.set_printoptions(precision=4)
    try:
        failed, tried = doctest.testfile(
            str(ROOT / page), module_relative=False, optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
        )
    finally:
        os.chdir(before)
    assert tried > 0 and failed == 0


def test_stubs_name_what_exists():
    import ast

    import oslrun

    stub = ast.parse((ROOT / "crates/oslrun-py/python/oslrun/__init__.pyi").read_text())
    classes = {node.name: node for node in stub.body if isinstance(node, ast.ClassDef)}
    functions = {node.name for node in stub.body if isinstance(node, ast.FunctionDef)}
    assert set(oslrun.__all__) == (set(classes) | functions) - {"Services"}
    for name, node in classes.items():
        if name == "Services":
            continue
        for member in node.body:
            if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                assert hasattr(getattr(oslrun, name), member.name), f"{name}.{member.name}"


def test_both_locks_have_the_same_versions():
    import re

    def versions(path):
        found = {}
        for name, version in re.findall(r'name = "(.*)"\nversion = "(.*)"', (ROOT / path).read_text()):
            found.setdefault(name, set()).add(version)
        return found

    root, own = versions("Cargo.lock"), versions("crates/oslrun-py/Cargo.lock")
    assert {name: own[name] for name in own.keys() & root.keys() if not own[name] <= root[name]} == {}


def test_the_notebook_runs():
    import json

    cells = json.loads((ROOT / "examples/noise.ipynb").read_text())["cells"]
    scope = {}
    for cell in cells:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), scope)
    assert scope["rows"].keys() == {"cell", "uperlin", "perlin", "simplex", "gabor"}
