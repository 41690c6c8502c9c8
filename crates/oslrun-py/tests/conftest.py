"""Shared by the tests: the folder of the project, its shaders, and the points of the command's grid."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
SEEDS = sorted([*ROOT.glob("osl/*.osl"), *ROOT.glob("tests/data/seeds/*.osl")])

#: This one lacks brackets, which only `--repair` adds.
REPAIRED = {ROOT / "osl/sprinkles.osl"}


def same_bits(a, b):
    """Whether two arrays have equal bits; a NaN equals every other."""
    a, b = np.asarray(a), np.asarray(b)
    if a.dtype != b.dtype or a.shape != b.shape:
        return False
    if a.dtype.kind == "f":
        nan = np.isnan(a) & np.isnan(b)
        return bool(np.all(nan | (np.ascontiguousarray(a).view(np.uint32) == np.ascontiguousarray(b).view(np.uint32))))
    return bool(np.array_equal(a, b))


@pytest.fixture
def command():
    """Runs the command in a process of its own: returns its exit code, its output and its messages."""

    def run(*words):
        done = subprocess.run([sys.executable, "-m", "oslrun", *map(str, words)], capture_output=True, cwd=ROOT)
        return done.returncode, done.stdout, done.stderr.decode()

    return run
