"""Words of earlier versions: each is answered with one sentence that names the present one. The only list of them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

COMMANDS = {
    "next": "`tarsus recommend`",
    "read": "`tarsus show FILE`",
    "compare": "`tarsus show FIRST SECOND`",
    "open": "`tarsus report FOLDER`",
}
"""What to use in place of a command."""

DESIGNS = {
    "landing": "pairs levels risk objective drive free tick shortest learn sensor effort seed",
    "gait": "objective risk look loss symmetry dead candidates duration seed",
    "adapt": "sense objective steps gaits hidden training noise repeats symmetry dead candidates duration seed",
}
"""Options of earlier `tarsus design` that are settings of its request now."""

OPTIONS = {
    "recommend --hz": '`--vary hz="5, 15"`',
    "recommend --volts": '`--vary volts="4, 6"`',
    "recommend --ramp": '`--vary ramp="0, 0.25"`',
    "recommend --gap": '`--vary gap="70 um, 90 um"`',
    **{f"show --{one}": f"`--read {one}=VALUE`" for one in ("axis", "step", "record")},
    "show --axis-unit": "`--read axis_unit=VALUE`",
    "show --channel": "`--read NAME=UNIT`",
    "sweep --slurm": '`--array N --sbatch "--partition=main --time=1:00:00"`',
    "sweep --tasks": "`--array N`",
    "sweep --status": "`tarsus show DIR`",
    "sweep --task": "`python -m tarsus.cli.task DIR NUMBER ARRAY`, as the array's script does",
    "sweep --submission": "`python -m tarsus.cli.task DIR NUMBER ARRAY`, as the array's script does",
    "yield --measure": "`--require MEASURE`",
    "yield --count": "`--robots N`, and of it `--draws N`, `--starts N` or `--from-rest T`",
    "yield --chunk": "`chunk` of `tarsus.yield_`",
}
OPTIONS |= {
    f"design {verb} --{name}": f"`--request {name}=VALUE`" for verb, names in DESIGNS.items() for name in names.split()
}
OPTIONS |= {
    f"{verb} --dask": "`--on ADDRESS`, or `--on local`"
    for verb in ("sweep", "yield", "calibrate", "recommend", *(f"design {one}" for one in DESIGNS))
}
"""What to use in place of an option of a command."""

VALUES = (
    ("sweep", "--on", "slurm", '`--array N --sbatch "--partition=main --time=1:00:00"`'),
    ("sweep", "--on", "array", "`--array N`"),
    ("", "--on", "dask:", "`--on ADDRESS`, or `--on local`"),
    ("yield", "--scatter", "dead=", "`--dead 0:5`"),
    ("yield", "--scatter", "weak=", '`--weak 0:5 --weakness "60 %"`'),
    ("report", "--draw", "branch:", "`--branch N`"),
)
"""Beginnings of values of an option: of a verb, or of any; and what to use in their place."""


def sentence(words: Sequence[str]) -> str | None:
    """What to say of a command line in words of an earlier version; None where there is none."""
    if not words:
        return None
    if words[0] in COMMANDS:
        return f"`tarsus {words[0]}` is gone: use {COMMANDS[words[0]]}"
    for word, after in pairwise((*words[1:], "")):
        name, equals, value = word.partition("=")
        for verb, option, begin, now in VALUES:
            if name == option and verb in ("", words[0]) and (value if equals else after).startswith(begin):
                return f"{option} {begin} is gone: use {now}"
        for key in (f"{words[0]} {name}", f"{' '.join(words[:2])} {name}"):
            if key in OPTIONS:
                return f"{name} is gone: use {OPTIONS[key]}"
    return None
