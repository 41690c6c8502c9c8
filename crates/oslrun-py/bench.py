"""Speed and memory of the package beside the command, in turns: `python bench.py [SIDE]` (3163: ten million points).

Prints the best and the median of the rounds, in nanoseconds of processor time for each point, and the peak of memory of
one run besides its arrays. The command prints the ranges of the values, and writes no file.
"""

import statistics
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SHADER = ROOT / "osl/Cobbled.osl"
ROUNDS = 7


def arrays(side):
    axis = np.arange(side, dtype=np.float32) / np.float32(side - 1)
    u, v = (np.ascontiguousarray(part) for part in np.broadcast_arrays(axis[None, :], axis[:, None]))
    return {"u": u, "v": v, "P": np.stack([u, v, np.ones_like(u)], -1)}


def cost(work, points):
    """Nanoseconds of processor time, on all cores together, for each point."""
    before = time.process_time()
    work()
    return (time.process_time() - before) / points * 1e9


def peak(side, output):
    """The megabytes at the peak of a run, without those of its arrays, in a process of its own."""
    import resource

    import oslrun

    shader, given = oslrun.compile(SHADER), arrays(side)
    size = sum(array.nbytes for array in given.values())
    out = shader(outputs=[output], **given)[output]
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024 - (size + out.nbytes) / 2**20


def main(side):
    import oslrun

    shader, given = oslrun.compile(SHADER), arrays(side)
    print(f"{side**2} points, {ROUNDS} rounds in turns; ns/point: best, median")
    for output in ("resultMask", "resultRGB"):
        words = [str(SHADER), "--outputs", output, "-g", f"{side}x{side}"]
        ways = (lambda: shader(outputs=[output], **given), lambda: oslrun._native.command(words))
        rounds = [tuple(cost(way, side**2) for way in ways) for _ in range(ROUNDS)]
        for name, times in zip(("arrays", "command"), zip(*rounds)):
            print(f"{output:12} {name:8} {min(times):7.1f} {statistics.median(times):7.1f}")
        best = [min(times) for times in zip(*rounds)]
        print(f"{output:12} points per second, of the command's: {best[1] / best[0]:.0%}")
        done = subprocess.run([sys.executable, __file__, str(side), output], capture_output=True, text=True, check=True)
        print(f"{output:12} peak besides the arrays: {float(done.stdout):.0f} MB")


if __name__ == "__main__":
    if len(sys.argv) > 2:
        print(peak(int(sys.argv[1]), sys.argv[2]))
    else:
        main(int(sys.argv[1]) if len(sys.argv) > 1 else 3163)
