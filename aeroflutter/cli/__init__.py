"""The command line: `aeroflutter COMMAND CASE [options]`.

Commands are imported when they are called, so that `--help` stays light. A new command is one
line in `COMMANDS` and one file beside this one.
"""

from __future__ import annotations

import gc
import keyword
import os
import re
import sys
from collections.abc import Sequence
from contextvars import copy_context
from typing import TYPE_CHECKING

from aeroflutter import __version__
from aeroflutter.cli.streams import Terminated, opened, say, terminable
from aeroflutter.errors import AeroflutterError, ConvergenceError, InputError
from aeroflutter.kernels.notice import noticing
from aeroflutter.stderr import silenced

if TYPE_CHECKING:
    from cyclopts import App

__all__ = ["COMMANDS", "main"]

COMMANDS = {
    "cases": "List the built-in cases.",
    "init": "Write a commented case file to start from.",
    "validate": "Check a case file and say what it describes.",
    "onset": "Where oscillation begins: free below a speed by proof, and the lowest cycle.",
    "import": "Write a case for a state space or a modal model of another program.",
    "rootlocus": "Linear flutter and divergence: roots against airspeed.",
    "pk": "Flutter of a modal model by p-k on its tabulated air forces: V-g, V-f.",
    "df": "Limit cycles by describing functions: amplitude against airspeed.",
    "lco": "Every limit cycle, stable or not, exactly; bifurcations located.",
    "tolerance": "The largest gap, or least friction, that keeps limit cycles small.",
    "hb": "Limit cycles by harmonic balance: as many harmonics as it takes, with stability.",
    "loop": "Whether a describing function can be believed: Bode, Nyquist, harmonics, verdict.",
    "spring": "The spring's path under a prescribed motion, and its describing function.",
    "simulate": "March in time: traces, end state, limit cycle, speed sweeps.",
    "chaos": "Periodic, quasi-periodic or chaotic: Lyapunov exponents, peaks against speed.",
    "map": "Flutter maps: how the motion ends over airspeed and initial pitch.",
    "reproduce": "The figures and tables of the thesis, by their own numbers.",
    "report": "One page to click through: every analysis of a case, motions included.",
    "sweep": "Monte-Carlo: flutter speed, onset and amplitude over uncertain sections.",
    "warmup": "Compile what the other commands would compile on their first run.",
}
"""Name and line of help of every command; the command is the function NAME of cli/NAME.py,
with an underscore behind where it is a word of Python's own."""

OK, FAILED, BAD_INPUT, NOT_CONVERGED, FAULT = 0, 1, 2, 3, 70
INTERRUPTED, BROKEN_PIPE, TERMINATED = 130, 141, 143

SELDOM = (100_000, 50, 100)
"""Thresholds of the collector of cycles in a process of one command: it imports thousands of things
that all stay, which the default thresholds go through again and again for nothing."""

_NEGATIVE = re.compile(r"-\.?\d")

_HELP = """\
Usage: aeroflutter COMMAND CASE [OPTIONS]

Flutter and limit cycles of a typical section with a nonlinear pitch spring.

CASE is a TOML file or the name of a built-in case; speeds are U* = V/(b omega_alpha), angles
are in degrees. Exit codes: 2 for bad input, 3 where a method did not converge.

Commands:
{commands}

`aeroflutter COMMAND --help` describes a command; `aeroflutter --version` prints the version.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line.

    Parameters
    ----------
    arguments
        Words after the program's name; by default those of the process.

    Returns
    -------
    int
        Exit code: 0, 2 for bad input, 3 where a method did not converge, 70 for a fault of the
        program, 130 if interrupted, 143 if terminated.
    """
    opened()
    words = _own_words() if arguments is None else list(arguments)
    try:
        with noticing(), terminable():
            copy_context().run(_run, words)  # what it tells is told in units of its own case
        sys.stdout.flush()
    except InputError as error:
        return _refuse(BAD_INPUT, *error.problems)
    except ConvergenceError as error:
        return _refuse(NOT_CONVERGED, str(error))
    except AeroflutterError as error:
        return _refuse(FAILED, str(error))
    except Terminated:
        return _refuse(TERMINATED, "terminated")
    except KeyboardInterrupt:
        return _refuse(INTERRUPTED, "interrupted")
    except BrokenPipeError:  # the reader has gone, as in `aeroflutter cases | head -1`
        silenced(sys.stdout)
        return BROKEN_PIPE
    except OSError as error:
        _flushed()
        return _refuse(FAILED, f"cannot go on: {_gone() or error.strerror or error}")
    except MemoryError:
        return _refuse(FAILED, "cannot go on: there is not enough memory for this")
    except Exception as error:  # noqa: BLE001 - whatever it is, the user gets one line
        from aeroflutter.cli.faults import reported

        reported(error, words)
        return FAULT
    return OK


def _own_words() -> list[str]:
    """The words of this process, which is then the command's own."""
    gc.set_threshold(*SELDOM)
    return sys.argv[1:]


def _gone() -> str:
    """That the working directory is there no more, if so: much fails then, and nothing says why."""
    try:
        os.getcwd()
    except OSError:
        return "the working directory has been removed; change to another one"
    return ""


def _flushed() -> None:
    """Have what was printed out; where that is what fails, Python may not try again at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        silenced(sys.stdout)


def _run(words: list[str]) -> None:
    # The two answers that need no parsing are given before cyclopts and rich are imported.
    if not words or words[0] in ("--help", "-h"):
        print(_HELP.format(commands="\n".join(f"  {n:<12}{line}" for n, line in COMMANDS.items())))
    elif words[0] == "--version":
        print(__version__)
    elif words[0] not in COMMANDS:
        raise InputError(_unknown_command(words[0]))
    else:
        _call(words)


def _call(words: list[str]) -> None:
    from cyclopts.exceptions import CycloptsError

    from aeroflutter.cli.former import renamed

    try:
        command, bound, _ = build_app().parse_args(
            _with_negative_values(renamed(words)), exit_on_error=False, print_error=False
        )
    except CycloptsError as error:
        error.verbose = False
        raise InputError(" ".join(str(error).split())) from None
    command(*bound.args, **bound.kwargs)


def _with_negative_values(words: list[str]) -> list[str]:
    """Bind `--alpha-deg -5:5:11` into one word: no option begins with a digit, a value may."""
    joined: list[str] = []
    for word in words:
        if _NEGATIVE.match(word) and joined and joined[-1].startswith("--"):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _unknown_command(word: str) -> str:
    from difflib import get_close_matches

    close = get_close_matches(word, COMMANDS, n=1)
    hint = f'did you mean "{close[0]}"?' if close else f"the commands are {', '.join(COMMANDS)}"
    return f"{word!r}: no such command; {hint}"


def build_app() -> App:
    """The cyclopts application with every command registered, none imported."""
    from cyclopts import App

    app = App(name="aeroflutter", version=__version__, help_format="plaintext")
    for name, line in COMMANDS.items():
        word = f"{name}_" if keyword.iskeyword(name) else name
        app.command(f"{__name__}.{word}:{word}", name=name, help=line)
    return app


def _refuse(code: int, *lines: str) -> int:
    for line in lines:
        say(line)
    return code
