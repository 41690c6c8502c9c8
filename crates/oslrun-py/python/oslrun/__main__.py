"""The command `oslrun`."""

import sys

from . import _native


def main():
    """Runs the command with the arguments of the process, and returns its exit code."""
    return _native.command_line(sys.argv[1:])


if __name__ == "__main__":
    sys.exit(main())
