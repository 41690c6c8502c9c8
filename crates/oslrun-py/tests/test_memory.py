"""Memory: a run needs its arrays, and little more."""

import subprocess
import sys

from conftest import ROOT


def test_ten_million_points_need_their_arrays():
    done = subprocess.run(
        [sys.executable, ROOT / "crates/oslrun-py/bench.py", "3163", "resultMask"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 200
