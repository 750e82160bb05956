"""The program `fingerpad` as a process of its own, with its progress, its errors and Ctrl-C.

A computation by finite elements takes memory and threads, and a crash must not end the interpreter: it runs in a child process.
The child is the program that the environment variable FINGERPAD_PROGRAM names; else, in a wheel with the program, this interpreter
with the compiled part of the package alone; else the first `fingerpad` on PATH.
"""

from __future__ import annotations

import importlib
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, NoReturn, Union

from fingerpad import _native
from fingerpad._errors import InputError, Interrupted, NotGoodEnough, NumericsError

#: Script of the child: the compiled part by its file, the time between lines of progress in s, the program's words.
CHILD = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("_native", sys.argv[1])
native = importlib.util.module_from_spec(spec)
spec.loader.exec_module(native)
sys.exit(native.run_program(["fingerpad", *sys.argv[3:]], float(sys.argv[2])))
"""
#: Time between lines of progress of the wheel's own program, s.
LINE_EVERY_S = 0.2
#: Environment variable that names the program.
VARIABLE = "FINGERPAD_PROGRAM"
#: Text of the error without a program.
MISSING = (
    "the program fingerpad was not found: this wheel has models and fingers alone, FINGERPAD_PROGRAM is not set, and no fingerpad is on "
    "PATH. In the repository, `cargo install --path offline/cli` builds the program, and "
    '`pip install ./bindings/python --config-settings=build-args="--features program"` a wheel that contains it'
)
#: How long an interrupted computation may take to save its results, s.
SAVE_WITHIN_S = 10.0
#: Exit codes of the program.
BAD_INPUT, NUMERICS, NOT_GOOD_ENOUGH, INTERRUPTED = 2, 3, 4, 130

SHARE = re.compile(r"(?P<what>[^:]+): (?P<percent>\d+) %(?:, (?P<message>.*))?")
SECONDS = re.compile(r"(?P<what>.+): \d+ s")
STAGE = re.compile(r" *[\d.]+ s  (?P<what>.+)")


class Progress(NamedTuple):
    """How far a computation has come."""

    what: str
    """The stage of the work."""
    share: float | None
    """Share that is done, 0 to 1, where it is known."""
    message: str
    """A remark, or nothing."""


#: Called with every sign of progress; an exception ends the computation. True shows a bar, False and None show nothing.
Progressing = Union[bool, Callable[[Progress], object], None]


def start() -> list[str]:
    """The words of a command line that start the program. Raises InputError where there is none."""
    if given := os.environ.get(VARIABLE):
        found = shutil.which(given)
        if found is None:
            raise InputError(f"{VARIABLE}: {given!r} is not a program that can be run; a path or a name on PATH is needed")
        return [found]
    if _native.HAS_PROGRAM:
        return [sys.executable, "-I", "-c", CHILD, _native.__file__, str(LINE_EVERY_S)]
    found = shutil.which("fingerpad")
    if found is None:
        raise InputError(MISSING)
    return [found]


def run(words: list[str], progress: Progressing) -> tuple[str, list[str]]:
    """Runs a command; returns its output and its warnings.

    Raises InputError and NumericsError with the program's own text, Interrupted after Ctrl-C once everything is saved.
    """
    show = Bar() if progress is True else progress or None
    child = subprocess.Popen(
        [*start(), *words],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        # A terminal's Ctrl-C would otherwise reach the child as well, and twice means at once.
        start_new_session=True,
    )
    lines: queue.Queue[str | None] = queue.Queue()
    output: list[str] = []
    assert child.stdout is not None and child.stderr is not None
    readers = [
        threading.Thread(target=_pass_on, args=(child.stderr, lines), daemon=True),
        threading.Thread(target=output.extend, args=(child.stdout,), daemon=True),
    ]
    for reader in readers:
        reader.start()
    messages: list[str] = []
    try:
        _follow(lines, show, messages)
        child.wait()
    except BaseException as error:
        _interrupt(child)
        _drain(lines, messages)
        if isinstance(error, KeyboardInterrupt):
            raise Interrupted(_after("interrupted: ", messages) or "nothing was kept") from None
        raise
    finally:
        if isinstance(show, Bar):
            show.close()
    for reader in readers:
        reader.join()
    if child.returncode != 0:
        _fail(child.returncode, messages)
    return "".join(output), [line for line in messages if line.startswith("warning: ")]


def _pass_on(stream: Any, lines: queue.Queue[str | None]) -> None:
    for line in stream:
        lines.put(line.rstrip("\n"))
    lines.put(None)


def _follow(lines: queue.Queue[str | None], show: Callable[[Progress], object] | None, messages: list[str]) -> None:
    """Shows progress until the child closes its output; keeps the other lines."""
    while True:
        try:
            # Ctrl-C is not seen during a wait without end on some platforms.
            line = lines.get(timeout=0.1)
        except queue.Empty:
            continue
        if line is None:
            return
        progress = _progress(line)
        if progress is None:
            messages.append(line)
        elif show is not None:
            show(progress)


def _progress(line: str) -> Progress | None:
    if line.startswith(("error: ", "warning: ", "interrupted")):
        return None
    if found := SHARE.fullmatch(line):
        return Progress(found["what"], int(found["percent"]) / 100, found["message"] or "")
    if found := SECONDS.fullmatch(line) or STAGE.fullmatch(line):
        return Progress(found["what"].strip(), None, "")
    return None


def _interrupt(child: subprocess.Popen[str]) -> None:
    """Interrupts the child, which saves its results, and waits; kills it after a time."""
    child.send_signal(signal.SIGINT)
    try:
        child.wait(SAVE_WITHIN_S)
    except (subprocess.TimeoutExpired, KeyboardInterrupt):
        child.kill()
        child.wait()


def _drain(lines: queue.Queue[str | None], messages: list[str]) -> None:
    while (line := lines.get(timeout=SAVE_WITHIN_S)) is not None:
        messages.append(line)


def _after(mark: str, messages: list[str]) -> str:
    """The messages from the last line that begins with `mark` on."""
    starts = [k for k, line in enumerate(messages) if line.startswith(mark)]
    return "\n".join(messages[starts[-1] :]).removeprefix(mark).strip() if starts else ""


def _fail(code: int, messages: list[str]) -> NoReturn:
    text = _after("error: ", messages) or "\n".join(messages) or f"the program ended with {code}"
    if code == BAD_INPUT:
        raise InputError(text)
    if code == INTERRUPTED:
        raise Interrupted(_after("interrupted: ", messages))
    if code == NOT_GOOD_ENOUGH:
        raise NotGoodEnough(text)
    raise NumericsError(text if code == NUMERICS else f"{text} (exit code {code})")


class Bar:
    """Progress by tqdm, a widget in notebooks; lines on standard error where tqdm is not installed."""

    def __init__(self) -> None:
        try:
            self._make: Any = importlib.import_module("tqdm.auto").tqdm
        except ImportError:
            self._make = None
        self._bar: Any = None
        self._what = ""

    def __call__(self, progress: Progress) -> None:
        """Shows it."""
        if self._make is None:
            share = "" if progress.share is None else f" {100 * progress.share:.0f} %"
            print(f"{progress.what}{share} {progress.message}".rstrip(), file=sys.stderr)
            return
        if self._bar is None or progress.what != self._what:
            self.close()
            self._what = progress.what
            form = "{desc}: {percentage:3.0f} % |{bar}| {postfix} {elapsed}" if progress.share is not None else "{desc}: {elapsed}"
            self._bar = self._make(total=1.0, desc=progress.what, bar_format=form, leave=False)
        if progress.share is not None:
            self._bar.n = progress.share
        self._bar.set_postfix_str(progress.message, refresh=False)
        self._bar.refresh()

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None


def flags(options: Mapping[str, Any]) -> list[str]:
    """Options as words: None and False are left out, True stands alone, numbers keep all their digits."""
    words = []
    for name, value in options.items():
        flag = "--" + name.rstrip("_").replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(flag)
        elif isinstance(value, (list, tuple)):
            words.append(f"{flag}={','.join(map(_word, value))}")
        else:
            words.append(f"{flag}={_word(value)}")
    return words


def _word(value: Any) -> str:
    if isinstance(value, (str, Path, int)):
        return str(value)
    return repr(float(value))
