"""The function that cyclopts takes for a command: its words, its options, their defaults and their help."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import Annotated, Any

from cyclopts import Parameter

from tarsus.cli import options
from tarsus.cli.asked import Asked
from tarsus.cli.declared import NO_DEFAULT, Declaration
from tarsus.cli.verb import MADE, SCENES, Verb
from tarsus.cli.words import kind_of, option_of


def line_of(command: Verb, verb: str, hook: Callable[..., int] | None = None) -> Callable[..., int]:
    """The function of a verb.

    One that does otherwise than `Asked.carry_out` has a ``hook``, if it is not given a function of its name in the file
    of its name here: it takes what is asked, and the options that only the command line has.
    """
    if command.own:
        hook = getattr(import_module(f"tarsus.cli.{verb}"), verb)
    own = {} if hook is None else _own_options(hook)
    parameters = [*_arguments(command, own), *own.values()]
    known = {one.name for one in parameters}
    said = command.declared.said if hook is None else command.declared.said | _said_by(hook)
    parameters += [one for one in _shared(command, said) if one.name not in known]
    signature = inspect.Signature(parameters)

    def call(*words: Any, **given: Any) -> int:
        bound = signature.bind(*words, **given)
        bound.apply_defaults()
        asked = Asked(command, verb, bound.arguments)
        if hook is None:
            return asked.carry_out()
        places = [bound.arguments[name] for name, one in own.items() if one.kind is one.POSITIONAL_ONLY]
        return hook(asked, *places, **{name: bound.arguments[name] for name in list(own)[len(places) :]})

    call.__name__ = call.__qualname__ = verb
    call.__doc__ = command.declared.purpose
    call.__signature__ = signature  # type: ignore[attr-defined]
    call.__annotations__ = {one.name: one.annotation for one in parameters}
    return call


SCENE = "A device (see `tarsus devices`) or a scene file (TOML)."
"""Said in place of the first sentence of a docstring on a scene."""
FOLDER = "Folder for what is found and its page; without it nothing is written."
"""Said of the output of a function that does not say what it is."""


def _arguments(command: Verb, own: dict[str, inspect.Parameter]) -> list[inspect.Parameter]:
    """Arguments of the function that can be written, but those of one meaning everywhere."""
    found = []
    for place, argument in enumerate(command.taken.values()):
        if argument.name in MADE or argument.name in own:
            continue
        if argument.type in SCENES and argument.default is None:  # which a file of settings names
            continue
        if argument.type in SCENES:
            said = argument.said
            if "Run" not in argument.type:  # a line has no scene of Python, which the first sentence names too
                said = f"{SCENE} {said.partition('. ')[2]}".rstrip()
            type_, default = Annotated[str, Parameter(help=said)], argument.default
        elif (how := kind_of(argument)) is not None:
            type_, default = option_of(argument, how)
        else:
            continue
        kind = inspect.Parameter.POSITIONAL_ONLY if place < command.words else inspect.Parameter.KEYWORD_ONLY
        if argument.many:
            kind, default = inspect.Parameter.VAR_POSITIONAL, NO_DEFAULT
        found.append(_parameter(argument.name, type_, default, kind))
    return found


def _shared(command: Verb, described: dict[str, str]) -> list[inspect.Parameter]:
    """Options that mean the same in every verb that takes them; described: what is said of each."""
    taken, writes = command.taken, bool(command.files or command.endings)
    found: list[tuple[str, Any, Any]] = []
    if command.scene is not None:
        found.append(("set", options.Set, None))
    if command.scene is not None or "law" in taken:
        found.append(("law", options.LawFiles, None))
    if "threads" in taken:
        found.append(("threads", options.Threads, None))
        found += [("on", options.On, None)] * (taken["threads"].type == "Workers")
    if writes:
        said = Parameter(help=described.get("output", FOLDER))
        needed = command.needs_output
        folder = Annotated[options.Folder if needed else options.MaybeFolder, said]
        found.append(("output", folder, NO_DEFAULT if needed else None))
    found += [("resume", options.Resume, False)] * ("resume" in taken)
    found += [("overwrite", options.Overwrite, False)] * writes
    found += [("report", options.Report, True)] * bool(command.page)
    return [_parameter(*one) for one in (*found, ("json", options.Json, False))]


def _own_options(hook: Callable[..., int]) -> dict[str, inspect.Parameter]:
    """Options of a verb that its function in Python does not have, with their help."""
    own = list(inspect.signature(hook, eval_str=True).parameters.values())[1:]
    said = _said_by(hook)
    return {one.name: one.replace(annotation=Annotated[one.annotation, Parameter(help=said[one.name])]) for one in own}


def _said_by(hook: Callable[..., int]) -> dict[str, str]:
    return Declaration(f"{hook.__module__}:{hook.__name__}").said


def _parameter(
    name: str, annotation: Any, default: Any = NO_DEFAULT, kind: Any = inspect.Parameter.KEYWORD_ONLY
) -> inspect.Parameter:
    given = inspect.Parameter.empty if default is NO_DEFAULT else default
    return inspect.Parameter(name, kind, default=given, annotation=annotation)
