"""The program `fingerpad`, as the command line has it."""

from __future__ import annotations

import sys

from fingerpad._native import run_program


def main() -> int:
    """Runs the program with the words of the command line; returns its exit code."""
    return run_program(["fingerpad", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
