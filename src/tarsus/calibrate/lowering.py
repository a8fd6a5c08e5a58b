"""Study to numbers: every row's scene made, every unit taken out, every fault named at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.messages import nearest, together
from tarsus.base.spec import with_values
from tarsus.base.units import is_number
from tarsus.base.workers import Workers
from tarsus.calibrate.cells import cells_of, limits_of
from tarsus.calibrate.description import Study
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.forward import Forward
from tarsus.calibrate.objective import Cells, Hypothesis, Objective
from tarsus.calibrate.problem import CalibrationProblem
from tarsus.calibrate.readings import MOTION, known_measures
from tarsus.calibrate.scenes import Cell, Row, RowChanges, Variant
from tarsus.calibrate.studyfile import Described
from tarsus.files.rows import TableRows
from tarsus.fit.unknowns import Unknowns
from tarsus.measure.measure import no_measure


@dataclass(frozen=True)
class Lowered:
    """A study ready to be searched.

    forward: the forward model; problem: what is searched; trained, others: numbers of the table's rows, from 0, that
    are fitted and that are only predicted; cells: of both, in this order.
    """

    study: Study
    table: TableRows
    forward: Forward
    problem: CalibrationProblem
    trained: tuple[int, ...]
    others: tuple[int, ...]
    cells: Cells

    @cached_property
    def driven(self) -> tuple[str, ...]:
        """Paths of the numbers that unknowns or options move in the first row."""
        sets = probes(self.problem.unknowns)
        seen = [one.changes(each, one.rows[0]) for one in self.forward.variants for each in sets]
        first, *others = (found.numbers for found in seen if found)
        return tuple(path for path in first if any(one.get(path) != first[path] for one in others))

    def settings(self) -> list[dict[str, Any]]:
        """What the options of each variant of the runs set in the first row, by path: what differs between variants in
        more than numbers."""
        middle = probes(self.problem.unknowns)[0]
        found = [one.changes(middle, one.rows[0]) or RowChanges.of({}, {}) for one in self.forward.variants]
        return [
            {path: one.wholes[path] for path in one.wholes if len({repr(two.word(path)) for two in found}) > 1}
            for one in found
        ]


def lower_study(described: Described, threads: Workers = None) -> Lowered:
    """A study and its table as a problem.

    Raises
    ------
    InputError
        With everything that does not fit: columns, units, paths, bounds, measures, rows, what the function does wrong.
    """
    study, table, faults = described.study, described.table, Faults()
    for column in study.conditions:
        faults.add(*table.need(column, "conditions"))
    for name, one in study.measures.items():
        faults.add(*table.need(one.column or name, f"measures.{name}"))
    faults.stop()
    trained, others = _split(study, table, faults)
    channels = _channels(study, faults)
    unknowns = _unknowns(study, faults)
    faults.stop()
    chosen = (*trained, *others)
    rows = [Row(f"row {n + 1}", conditions_of(study, table, table.rows[n], f"row {n + 1}", faults)) for n in chosen]
    faults.stop()
    rows += _constraint_rows(study, table, rows[0].cells, faults)
    faults.stop()
    variants = _variants(described, unknowns, tuple(rows), faults)
    faults.stop()
    forward = Forward(variants, unknowns.names, tuple(channels), study.sampling, threads)
    middle = unknowns.by_name(np.full(len(unknowns), 0.5))
    cells = cells_of(study, table, chosen, variants[0], middle, faults)
    limits = limits_of(study, channels, faults)
    faults.stop()
    problem = CalibrationProblem(
        unknowns,
        tuple(_hypotheses(study, channels, variants)),
        forward,
        Objective(cells.at(range(len(trained))), tuple(limits)),
        (*range(len(trained)), *range(len(chosen), len(rows))),
    )
    return Lowered(study, table, forward, problem, trained, others, cells)


def _split(study: Study, table: TableRows, faults: Faults) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Rows that are fitted and rows that are only predicted, from 0."""
    columns = [one.column or name for name, one in study.measures.items()]
    known = [n for n, row in enumerate(table.rows) if any(row[column] for column in columns)]
    if study.train is None:
        chosen = known
    else:
        wrong = [n for n in study.train if not 1 <= n <= len(table)]
        faults.add(*(f"train: the table has rows 1 to {len(table)}, got {n}" for n in wrong))
        chosen = [n - 1 for n in dict.fromkeys(study.train) if n not in wrong]
        faults.add(*(f"train: row {n + 1} holds no measured value" for n in chosen if n not in known))
    if not chosen:
        faults.add("train: expected at least one row with a measured value")
    return tuple(chosen), tuple(n for n in range(len(table)) if n not in chosen)


def _channels(study: Study, faults: Faults) -> list[str]:
    """Measures of the run that are read, each checked."""
    units, foot, feet = known_measures(), study.sampling.foot, study.scene.robot.feet
    if foot is not None and foot not in feet:
        faults.add(f"sampling.foot: the robot has no foot '{foot}'{nearest(foot, feet)}")
    wanted = [(f"measures.{name}.measure", one.measure, False) for name, one in study.measures.items()]
    for name, choice in study.choices.items():
        if len(set(choice.options)) < len(choice.options):
            faults.add(f"choices.{name}.options: one is there twice")
        for option in choice.options:
            for column, measure in choice.measures(option).items():
                where = f"choices.{name}.options.{option}.{column}"
                if column not in study.measures:
                    faults.add(f"{where}: there is no measure of that name{nearest(column, study.measures)}")
                elif measure in units and units[measure] != units.get(own := study.measures[column].measure):
                    faults.add(f"{where}: '{measure}' has another unit than '{own}'")
                wanted.append((where, measure, False))
    wanted += [(f"constraints.{n}.measure", one.measure, True) for n, one in enumerate(study.constraints)]
    for where, measure, motion in wanted:
        known = [*units, *MOTION] if motion else list(units)
        if measure not in known:
            faults.add(f"{where}: {no_measure(measure, known)}")
    return list(dict.fromkeys(measure for _, measure, _ in wanted))


def _unknowns(study: Study, faults: Faults) -> Unknowns:
    """Unknowns with bounds and priors in SI."""
    for name in study.unknowns:
        if name in study.choices:
            faults.add(f"unknowns.{name}: is also the name of a choice; give it another one")
    named = [one.model_copy(update={"name": name}) for name, one in study.unknowns.items()]
    try:
        return Unknowns.of(study.scene, named)
    except InputError as error:
        faults.add(*(f"unknowns.{text}" for text in error.problems))
        faults.stop()
        raise


def conditions_of(
    study: Study, table: TableRows, given: Mapping[str, Any], where: str, faults: Faults
) -> dict[str, Cell]:
    """Cells of a row by condition: numbers in columns that hold numbers, else words."""
    found: dict[str, Cell] = {}
    for column in study.conditions:
        text = str(given.get(column, ""))
        if not text:
            faults.add(f"{where}: '{column}': expected a value, the cell is empty")
        elif not any(is_number(row[column]) for row in table.rows):
            found[column] = text
        elif is_number(text):
            found[column] = float(text)
        else:
            faults.add(f"{where}: '{column}': expected a number, as in the table, got '{text}'")
    return found


def _constraint_rows(study: Study, table: TableRows, first: Mapping[str, Cell], faults: Faults) -> list[Row]:
    """Rows of the constraints that have conditions of their own."""
    rows = []
    for n, constraint in enumerate(study.constraints):
        for m, given in enumerate(constraint.conditions):
            where = f"constraints.{n}.conditions.{m}"
            faults.add(*strange(study, given, where))
            cells = conditions_of(study, table, {**first, **given}, where, faults)
            rows.append(Row(constraint.name, cells, constraint.set, constraint.measure in MOTION))
    return rows


def strange(study: Study, given: Iterable[str], where: str) -> list[str]:
    """A sentence for each column that is no condition."""
    return [
        f"{where}: there is no condition '{column}'{nearest(column, study.conditions)}"
        for column in given
        if column not in study.conditions
    ]


def _variants(described: Described, unknowns: Unknowns, rows: tuple[Row, ...], faults: Faults) -> tuple[Variant, ...]:
    """A variant for every combination of words that the study's function looks at, its scenes tried in the middle of
    the bounds, and its function at their ends."""
    study, (middle, *ends) = described.study, probes(unknowns)
    paths = {path: name for name, own in zip(unknowns.names, unknowns.targets, strict=True) for path in own}
    words = {name: one.options for name, one in study.choices.items() if not isinstance(one.options, dict)}
    every = []
    for options in product(*words.values()):
        named = dict(zip(words, options, strict=True))
        one = Variant(study.scene, described.defined, named, rows, paths, study.sampling.draws > 1)
        every.append(one)
        check_rows(one, middle, faults)
    faults.stop()
    with faults.noted():
        for one, each in product(every, ends):
            one.changes(each, rows[0])
    faults.stop()
    faults.add(*(f"{path}: it changes nothing in any row" for path in _idle(every, unknowns)))
    with faults.noted("unknowns"):
        for each in ends:
            with_values(every[0].scene_of(middle, rows[0]), {path: each[name] for path, name in paths.items()})
    return tuple(every)


def _idle(variants: Sequence[Variant], unknowns: Unknowns) -> list[str]:
    """Paths of the unknowns and of the choices of words that leave the changes of every row as they are: an unknown at
    both ends as in the middle, and a choice whatever the unknowns."""
    rows, (middle, *ends) = variants[0].rows, probes(unknowns)

    def differ(one: Variant, values: dict[str, float], other: Variant, others: dict[str, float]) -> bool:
        found = [(one.changes(values, row), other.changes(others, row)) for row in rows]
        return any((a and (a.key, a.numbers)) != (b and (b.key, b.numbers)) for a, b in found)

    moving = {
        f"unknowns.{unknowns.names[i // 2]}"
        for i, end in enumerate(ends)
        if any(differ(one, middle, one, end) for one in variants)
    }
    for one, other in combinations(variants, 2):
        apart = [name for name, option in one.options.items() if other.options[name] != option]
        if len(apart) == 1 and any(differ(one, each, other, each) for each in (middle, *ends)):
            moving.add(f"choices.{apart[0]}")
    chosen = [name for name in variants[0].options if len({one.options[name] for one in variants}) > 1]
    every = [*(f"unknowns.{name}" for name in unknowns.names), *(f"choices.{name}" for name in chosen)]
    return [path for path in every if path not in moving]


def probes(unknowns: Unknowns) -> list[dict[str, float]]:
    """Sets at which a function is tried: the middle of the bounds, and both ends of each unknown."""
    count = len(unknowns)
    places = [np.where(np.arange(count) == i, end, 0.5) for i in range(count) for end in (0.0, 1.0)]
    return [unknowns.by_name(place) for place in [np.full(count, 0.5), *places]]


def check_rows(variant: Variant, values: Mapping[str, float], faults: Faults) -> None:
    """Note what is wrong with the scenes of a variant's rows for SI values of the unknowns."""
    own = []
    for row in variant.rows:
        try:
            variant.scene_of(values, row)
        except InputError as error:
            own += [str(problem) for problem in error.problems]
    faults.add(*together(list(dict.fromkeys(own))))


def _hypotheses(study: Study, channels: list[str], variants: Sequence[Variant]) -> list[Hypothesis]:
    """Every combination of options, with its variant of the runs and the channel of every column."""
    out, words = [], [one.options for one in variants]
    for options in product(*(one.options for one in study.choices.values())):
        named = dict(zip(study.choices, options, strict=True))
        meaning = {name: one.measure for name, one in study.measures.items()}
        for choice, option in named.items():
            meaning |= study.choices[choice].measures(option)
        run = words.index({name: named[name] for name in words[0]})
        out.append(Hypothesis(named, run, tuple(channels.index(measure) for measure in meaning.values())))
    return out
