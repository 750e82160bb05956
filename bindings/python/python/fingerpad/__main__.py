"""The program `fingerpad`, as the command line has it."""

from __future__ import annotations

import os
import subprocess
import sys

from fingerpad import _native
from fingerpad._errors import InputError
from fingerpad._program import BAD_INPUT, VARIABLE, start


def main() -> int:
    """Runs the program with the words of the command line; returns its exit code."""
    words = sys.argv[1:]
    if _native.HAS_PROGRAM and not os.environ.get(VARIABLE):
        return _native.run_program(["fingerpad", *words])
    try:
        program = start()
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT
    if os.name == "posix":
        os.execv(program[0], [*program, *words])
    return subprocess.call([*program, *words])


if __name__ == "__main__":
    sys.exit(main())
