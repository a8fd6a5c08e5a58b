"""The verbs of the command line, and what becomes of their errors."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from tarsus.cli import console, former, front, interrupts
from tarsus.cli.declared import Declaration
from tarsus.cli.interrupts import INTERRUPTED
from tarsus.cli.verbs import VERBS, declared, line_of

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

    from cyclopts import App

T = TypeVar("T")

GROUP = "tarsus.commands"
"""Entry point group of further verbs: name = a function that cyclopts takes."""

DONE, FAILED, BAD_INPUT = 0, 1, 2

SHARED = (
    "--set",
    "--law",
    "--duration",
    "--seed",
    "--threads",
    "--on",
    "--output",
    "-o",
    "--resume",
    "--overwrite",
    "--no-report",
)
"""Options of many verbs: one that a verb lacks is no misspelt other one."""

VOICES = {
    "-q": console.Voice.QUIET,
    "--quiet": console.Voice.QUIET,
    "-v": console.Voice.VERBOSE,
    "--verbose": console.Voice.VERBOSE,
}
"""Words that every verb understands, wherever they stand: how much is said besides results and errors."""


def build(words: list[str]) -> App:
    """The application: one command a verb, results returned, errors left to `run`.

    Of a command line that begins with one of `VERBS` that verb alone: nothing else is loaded.
    """
    from cyclopts import App

    app = App(
        name="tarsus",
        help=front.PURPOSE,
        version=_version,
        help_format="plaintext",
        help_epilogue=front.EVERYWHERE,
        exit_on_error=False,
        print_error=False,
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    own = words[:1] if words and words[0] in VERBS else VERBS
    for verb in own:
        app.command(line_of(verb), name=verb)
    for command in _installed(lambda entry: entry.load()).values() if own is VERBS else ():
        app.command(command)
    return app


def _installed(found_by: Callable[[EntryPoint], T]) -> dict[str, T]:
    """What is found of the verbs that installed packages add under the entry point group ``tarsus.commands``."""
    from importlib.metadata import entry_points

    found: dict[str, T] = {}
    for entry in sorted(entry_points(group=GROUP), key=lambda entry: entry.name):
        if entry.name in (*VERBS, *found):
            console.complain([f"the verb '{entry.name}' of {entry.value} is left out: tarsus has it already"])
            continue
        try:
            found[entry.name] = found_by(entry)
        except Exception as error:
            console.complain([f"the verb '{entry.name}' of {entry.value} cannot be loaded: {error}"])
    return found


def _front_page() -> str:
    """The help of the whole, for which no verb is loaded."""
    own = {verb: declared(verb).sentence for verb in VERBS}
    return front.front_page(own | _installed(lambda entry: Declaration(entry.value).sentence))


def _version() -> str:
    from importlib.metadata import version

    return version("tarsus")


def run(argv: list[str]) -> int:
    """Run one command line. `-q` in it leaves results and errors alone, `-v` says more."""
    voice, words = _voice_of(argv)
    if voice is None:
        console.complain(["-q says less and -v says more: give one of them"])
        return BAD_INPUT
    with console.speaking(voice):
        return _run(words)


def _voice_of(argv: list[str]) -> tuple[console.Voice | None, list[str]]:
    """How much is to be said, None where the line contradicts itself, and the line without these words."""
    end = argv.index("--") if "--" in argv else len(argv)
    asked = {VOICES[word] for word in argv[:end] if word in VOICES}
    words = [*(word for word in argv[:end] if word not in VOICES), *argv[end:]]
    return (asked or {console.Voice.USUAL}).pop() if len(asked) < 2 else None, words


def _run(argv: list[str]) -> int:
    """Run one command line without words for the voice."""
    said = former.sentence(argv)
    if said is not None:
        console.complain([said])
        return BAD_INPUT
    return exit_code(lambda: _page() if argv in ([], ["--help"], ["-h"]) else _done(argv), argv)


def _page() -> int:
    print(_front_page())
    return DONE


def _done(argv: list[str]) -> object:
    code = _command(argv)
    console.detail(_spent())
    return code


def exit_code(do: Callable[[], object], argv: Sequence[str] = ()) -> int:
    """The exit code of what is done, by the command line ``argv``.

    Every failure ends as sentences on stderr and an exit code: 1 when the physics or a check failed, 2 for
    bad input, 130 when interrupted. A reader that closes the pipe early (`tarsus show ... | head`) is no error.
    """
    try:
        with interrupts.heard(argv):
            code = do()
        sys.stdout.flush()
    except KeyboardInterrupt as stop:
        console.complain([interrupts.sentence(stop, argv)])
        return INTERRUPTED
    except (BrokenPipeError, SystemExit) as stop:
        if isinstance(stop, SystemExit) and not isinstance(stop.__context__, BrokenPipeError):
            raise  # else it is how rich ends a page of help that nobody reads on
        console.unread(sys.stdout)
        return DONE
    except MemoryError:
        console.complain(["there is not enough memory for this"])
        return FAILED
    except Exception as error:
        from tarsus.base.errors import InputError

        if isinstance(error.__cause__, KeyboardInterrupt):  # numpy answers one in its own words
            console.complain([interrupts.sentence(error.__cause__, argv)])
            return INTERRUPTED
        if isinstance(error, InputError):
            console.complain(error.problems)
            return BAD_INPUT
        if isinstance(error, OSError):
            console.complain([console.os_sentence(error)])
            return BAD_INPUT
        if os.environ.get("TARSUS_TRACEBACK"):
            raise
        if console.voice() is console.Voice.VERBOSE:
            import traceback

            traceback.print_exc()
        console.complain([f"{_defect(error)} (-v shows where it happened)"])
        return FAILED
    return code if isinstance(code, int) else DONE


def _defect(error: Exception) -> str:
    """What nobody foresaw, with the last line of this library or of a user's file that it went through."""
    import sysconfig
    import traceback

    from tarsus.base.pythonfile import said

    others = tuple({sysconfig.get_path(name) for name in ("stdlib", "purelib", "platlib")})
    own = os.path.dirname(os.path.dirname(__file__))
    lines = traceback.extract_tb(error.__traceback__)
    last = [one for one in lines if one.filename.startswith(own) or not one.filename.startswith(others)][-1]
    return (
        f"{last.filename}, line {last.lineno}: {said(error)}; unless that file is yours, this is a defect of tarsus, "
        "please report it"
    )


def _spent() -> str:
    """Time and memory that this process has taken, for who asked for more."""
    import time

    spent = f"{time.process_time():.2f} s of CPU"
    try:
        import resource
    except ImportError:  # Windows
        return spent
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (1024 if sys.platform == "darwin" else 1)
    return f"{spent}, at most {kilobytes / 1024:.0f} MiB of memory"


def _command(argv: list[str]) -> int:
    """What the verb of a command line returns; bad input where the line cannot be read."""
    from cyclopts import CycloptsError

    app = build(argv)
    try:
        return app(argv)
    except CycloptsError as error:
        console.complain([f"{_sentence(error, argv)} See `tarsus {_verb(app, argv)}--help`."])
        return BAD_INPUT


def _sentence(error: Any, argv: list[str]) -> str:
    """What is wrong with the words, where cyclopts says it in terms of programs."""
    from cyclopts import CoercionError, MissingArgumentError, UnknownOptionError, UnusedCliTokensError, ValidationError

    error.verbose = False
    if isinstance(error, UnusedCliTokensError):
        unused = list(error.unused_tokens or ())
        before = argv[argv.index(unused[0]) - 1] if unused and unused[0] in argv else ""
        cure = " (a value with a blank stands in quotes)" if "=" in before else ""
        return f"unexpected: {' '.join(unused)}{cure}."
    if isinstance(error, UnknownOptionError) and (name := error.token.keyword or error.token.value) in SHARED:
        return f"this verb has no {name}."
    if isinstance(error, ValidationError) and error.argument is not None and error.argument.tokens:
        return f"{error.argument.tokens[0].keyword or error.argument.name}: {error.exception_message}."
    if isinstance(error, MissingArgumentError) and error.argument is not None and not error.argument.tokens:
        given = [name for name in error.argument.names if name in argv]
        return f"{given[0]} takes a value." if given else f"{error.argument.names[0]} is missing."
    if isinstance(error, CoercionError) and error.msg and error.token is not None:
        return f"{error.token.keyword or error.token.value}: {error.msg}."
    return str(error)


def _verb(one: App, argv: list[str]) -> str:
    """`verb ` when the line begins with one, for pointing at the right help page."""
    known: list[str] = []
    for word in argv:
        if word.startswith("-") or word not in one:
            break
        known.append(word)
        one = one[word]
    return f"{' '.join(known)} " if known else ""
