"""Study to numbers: every name resolved, every unit taken out, every fault named at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from typing import Any

import numpy as np

from tarsus.base.errors import InputError
from tarsus.base.expressions import Expression
from tarsus.base.messages import nearest
from tarsus.base.spec import float_paths, with_values
from tarsus.base.units import parse_quantity
from tarsus.base.workers import Workers
from tarsus.calibrate.cells import cells_of, limits_of
from tarsus.calibrate.description import Option, Study
from tarsus.calibrate.faults import Faults
from tarsus.calibrate.forward import Forward
from tarsus.calibrate.objective import Hypothesis, Objective
from tarsus.calibrate.problem import CalibrationProblem
from tarsus.calibrate.readings import MOTION, known_measures
from tarsus.calibrate.scenes import Interpolated, Row, Setting, Variant, finite
from tarsus.files.rows import TableRows, number_of
from tarsus.fit.unknowns import Unknowns
from tarsus.measure.measure import no_measure
from tarsus.model.scene import Scene

PEAK = "peak"
"""The channel that shows whether flights can be seen; always read."""


@dataclass(frozen=True)
class Lowered:
    """A study ready to be searched.

    forward: the forward model; problem: what is searched; trained, others: numbers of the table's rows, from 0, that
    are fitted and that are only predicted; cells of the latter are those of ``other_cells``.
    """

    study: Study
    table: TableRows
    forward: Forward
    problem: CalibrationProblem
    trained: tuple[int, ...]
    others: tuple[int, ...]
    other_observed: np.ndarray
    other_absolute: np.ndarray

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """What the table's rows are called: their conditions."""

        def shown(column: str, cell: str) -> str:
            one = self.study.conditions[column]
            return cell if one.words or one.unit == "1" else f"{cell} {one.unit}"

        return tuple(" ".join(shown(c, row[c]) for c in self.study.conditions) for row in self.table.rows)


def lower_study(study: Study, table: TableRows, threads: Workers = None) -> Lowered:
    """A study and its table as a problem.

    Raises
    ------
    InputError
        With everything that does not fit: columns, units, paths, expressions, bounds, measures, rows.
    """
    faults = Faults()
    for where, wanted in (("conditions", study.conditions),):
        faults.add(*(text for column in wanted for text in table.need(column, f"{where}.{column}")))
    for name, one in study.measures.items():
        faults.add(*table.need(one.column or name, f"measures.{name}"))
    faults.stop()
    trained, others = _split(study, table, faults)
    channels = _channels(study, faults)
    derived = _expressions(study, faults)
    faults.stop()
    conditions = [conditions_of(study, row, f"row {n + 1}", faults) for n, row in enumerate(table.rows)]
    faults.stop()
    runs, hypotheses = _hypotheses(study, channels)
    chosen = [n for n in (*trained, *others)]
    built = [
        _variant(study, options, [conditions[n] for n in chosen], [f"row {n + 1}" for n in chosen], derived, faults)
        for options in runs
    ]  # fmt: skip
    faults.stop()
    unknowns = _unknowns(study, built[0].rows[0].template, faults)
    faults.stop()
    built = [_with_tables(study, one, unknowns, faults) for one in built]
    _check_values(built, unknowns, faults)
    faults.stop()
    forward = Forward(tuple(built), unknowns.names, tuple(channels), study.sampling, threads)
    rows = tuple(range(len(trained)))
    everywhere = any(one.rows == "all" for one in study.constraints)
    if everywhere:
        rows += tuple(range(len(trained), len(chosen)))
    own = [n for n, row in enumerate(built[0].rows) if n >= len(chosen)]
    rows += tuple(own)
    middle = dict(
        zip(unknowns.names, unknowns.values(np.full((1, len(unknowns)), 0.5))[0].tolist(), strict=True)
    )
    cells, other = cells_of(study, table, trained, others, built[0], middle, faults)
    limits = limits_of(study, channels, len(trained), len(chosen) if everywhere else len(trained), faults)
    faults.stop()
    objective = Objective(cells, tuple(limits), study.search.robust)
    problem = CalibrationProblem(
        unknowns, tuple(hypotheses), forward, objective, rows, tuple(f"row {n + 1}" for n in trained),
        study.sampling.resolution, channels.index(PEAK),
        lambda run, one, numbers: forward.slopes(run, one, numbers, unknowns.high - unknowns.low),
    )  # fmt: skip
    faults.stop()
    return Lowered(study, table, forward, problem, trained, others, other.observed, other.absolute)


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
    wanted = [(f"measures.{name}.measure", one.measure, False) for name, one in study.measures.items()]
    for name, choice in study.choices.items():
        for key, option in choice.options.items():
            for column, measure in option.measures.items():
                where = f"choices.{name}.options.{key}.measures.{column}"
                if column not in study.measures:
                    faults.add(f"{where}: there is no measure of that name{nearest(column, study.measures)}")
                wanted.append((where, measure, False))
    wanted += [
        (f"constraints.{n}.measure", one.measure, one.rows is None) for n, one in enumerate(study.constraints)
    ]
    for where, measure, motion in wanted:
        known = [*known_measures(), *MOTION] if motion else list(known_measures())
        if measure not in known:
            faults.add(f"{where}: {no_measure(measure, known)}")
    return list(dict.fromkeys([*(measure for _, measure, _ in wanted), PEAK]))


def _expressions(study: Study, faults: Faults) -> dict[tuple[str, ...], list[tuple[str, Expression]]]:
    """Expressions of the study (key ()) and of each option (key (choice, option)), checked."""
    known = {*study.unknowns, *study.constants, *study.conditions}
    known |= {name for one in study.along.values() for name in one.names}
    tables: list[tuple[tuple[str, ...], str, Mapping[str, str]]] = [
        (("choices", name, key), f"choices.{name}.options.{key}.derived", option.derived)
        for name, choice in study.choices.items()
        for key, option in choice.options.items()
    ]
    tables.append(((), "derived", study.derived))
    made: dict[tuple[str, ...], list[tuple[str, Expression]]] = {}
    of_options = {target for _, _, table in tables[:-1] for target in table if "." not in target}
    for key, where, table in tables:
        names = known | (of_options if not key else set())
        for target, text in table.items():
            expression = Expression(text)
            faults.add(*(f"{where}.{target}: {said}" for said in expression.check(names)))
            if "." not in target:
                names = names | {target}
            made.setdefault(key, []).append((target, expression))
    return made


def conditions_of(
    study: Study, cells: Mapping[str, Any], where: str, faults: Faults
) -> tuple[dict[str, float], dict[str, str]]:
    """Conditions of a row: numbers in SI and words, by column; cells are texts, numbers in the column's unit, or texts
    with a unit."""
    numbers: dict[str, float] = {}
    words: dict[str, str] = {}
    for column, one in study.conditions.items():
        cell = cells.get(column, "")
        if one.words:
            if cell in one.words:
                words[column] = str(cell)
            else:
                faults.add(
                    f"{where}: '{column}' is '{cell}', which is no word{nearest(str(cell), one.words)}"
                )
            continue
        try:
            text = str(number_of(str(cell)))
        except ValueError:
            text = str(cell)
        try:
            if text == "None":
                raise InputError("expected a number, the cell is empty")
            bare = not any(c.isalpha() for c in text.replace("e", ""))
            numbers[column] = parse_quantity(
                f"{text} {one.unit}" if bare and one.unit != "1" else text, one.unit
            )
        except InputError as error:
            faults.add(*(f"{where}: '{column}': {said}" for said in error.problems))
    return numbers, words


def _hypotheses(study: Study, channels: list[str]) -> tuple[list[dict[str, str]], list[Hypothesis]]:
    """Options of every variant of the runs, and all hypotheses."""
    names = list(study.choices)
    own = [
        name
        for name in names
        if any(option.set or option.derived for option in study.choices[name].options.values())
    ]
    runs: list[dict[str, str]] = []
    hypotheses = []
    for options in product(*(study.choices[name].options for name in names)):
        chosen = dict(zip(names, options, strict=True))
        run = {name: chosen[name] for name in own}
        if run not in runs:
            runs.append(run)
        meaning = {name: one.measure for name, one in study.measures.items()}
        for name, key in chosen.items():
            meaning |= study.choices[name].options[key].measures
        columns = tuple(channels.index(measure) for measure in meaning.values())
        hypotheses.append(Hypothesis(chosen, runs.index(run), columns))
    return runs, hypotheses


def _variant(
    study: Study,
    options: Mapping[str, str],
    conditions: list[tuple[dict[str, float], dict[str, str]]],
    names: list[str],
    derived: Mapping[tuple[str, ...], list[tuple[str, Expression]]],
    faults: Faults,
) -> Variant:
    """A variant without unknowns: templates of its rows, those of the table and then those of constraints."""
    chosen = {(name, key): study.choices[name].options[key] for name, key in options.items()}
    rows = run_rows(study, list(chosen.values()), conditions, names, faults)
    first = conditions[0]
    for n, constraint in enumerate(study.constraints):
        for m, given in enumerate(constraint.conditions):
            unknown = [column for column in given if column not in study.conditions]
            where = f"constraints.{n}.conditions.{m}"
            faults.add(
                *(f"{where}: there is no condition '{c}'{nearest(c, study.conditions)}" for c in unknown)
            )
            own, words = conditions_of(replace_conditions(study, given), {**given}, where, faults)
            merged = {**first[0], **own}, {**first[1], **words}
            made = run_rows(
                study, list(chosen.values()), [merged], [constraint.name], faults, constraint.set, where
            )
            motion = constraint.measure in MOTION
            rows += [replace(row, motion=motion) for row in made]
    expressions = [one for key in chosen for one in derived.get(("choices", *key), [])] + list(
        derived.get((), [])
    )
    rows = _sharing(rows)
    settings = tuple(Setting(name, one.paths) for name, one in study.unknowns.items())
    constants = {}
    for name, value in study.constants.items():
        constants[name] = faults.constant(value, f"constants.{name}")
    return Variant(dict(options), tuple(rows), constants, settings, (), tuple(expressions))


def _sharing(rows: list[Row]) -> list[Row]:
    """The rows with one template where theirs are equal: what is made of a template is made once."""
    kept: list[Scene] = []
    out = []
    for row in rows:
        same = next((one for one in kept if one == row.template), None)
        if same is None:
            kept.append(row.template)
        out.append(row if same is None else replace(row, template=same))
    return out


def replace_conditions(study: Study, given: Mapping[str, Any]) -> Study:
    """The study with only the conditions that are given."""
    kept = {column: one for column, one in study.conditions.items() if column in given}
    return study.model_copy(update={"conditions": kept})


def run_rows(
    study: Study,
    options: Sequence[Option],
    conditions: list[tuple[dict[str, float], dict[str, str]]],
    names: list[str],
    faults: Faults,
    last: Mapping[str, Any] | None = None,
    where: str = "choices",
) -> list[Row]:
    """Rows under some options; rows of the same words share their template."""
    templates: dict[tuple[str, ...], Scene] = {}
    rows = []
    for (numbers, words), name in zip(conditions, names, strict=True):
        key = tuple(words.values())
        if key not in templates:
            scene = study.scene
            for column, word in words.items():
                scene = faults.scene(
                    scene, study.conditions[column].words[word], f"conditions.{column}.words.{word}"
                )
            for option in options:
                scene = faults.scene(scene, option.set, where)
            if study.sampling.draws > 1 and scene.initial.velocity is None:
                scene = with_values(scene, {"initial.velocity": (0.0,) * scene.robot.structure.size})
            templates[key] = scene
        template = templates[key]
        changed = faults.scene(template, dict(last or {}), f"{where}.set")
        if any(path not in float_paths(template) for path in last or {}):
            template = changed
        known = float_paths(changed)
        fixed = {path: numbers[c] for c in numbers for path in study.conditions[c].paths}
        faults.paths(template, known, fixed, f"{name}: conditions")
        kept = {path: known[path].value for path in last or {} if path in known}
        rows.append(Row(name, template, fixed, numbers, kept))
    return rows


def _unknowns(study: Study, scene: Scene, faults: Faults) -> Unknowns:
    """Unknowns with bounds and priors in SI."""
    for name in study.unknowns:
        if name in study.conditions or name in study.constants:
            faults.add(f"unknowns.{name}: is also the name of a condition or constant; give it another one")
    try:
        return Unknowns.of(
            scene, [one.model_copy(update={"name": name}) for name, one in study.unknowns.items()]
        )
    except InputError as error:
        faults.add(*(f"unknowns.{text}" for text in error.problems))
        faults.stop()
        raise


def _with_tables(study: Study, variant: Variant, unknowns: Unknowns, faults: Faults) -> Variant:
    """A variant with its interpolation tables."""
    along = []
    known = float_paths(variant.rows[0].template)
    for name, one in study.along.items():
        where = f"along.{name}"
        if name not in unknowns.names:
            faults.add(f"{where}: there is no unknown '{name}'{nearest(name, unknowns.names)}")
            continue
        at = tuple(
            faults.quantity(x, unknowns.units[unknowns.names.index(name)], f"{where}.at") for x in one.at
        )
        if any(b <= a for a, b in pairwise(at)):
            faults.add(f"{where}.at: expected values that increase")
        faults.paths(variant.rows[0].template, known, one.paths, f"{where}.paths")
        lists: dict[str, tuple[Any, ...]] = {**one.paths, **one.names}
        for target, values in lists.items():
            if len(values) != len(at):
                faults.add(f"{where}.{target}: expected {len(at)} values, got {len(values)}")
                continue
            unit = known[target].unit if target in known else "1"
            si = tuple(faults.quantity(v, unit, f"{where}.{target}") for v in values)
            along.append(Interpolated(name, at, target, si))
    return replace(variant, along=tuple(along))


def _check_values(variants: list[Variant], unknowns: Unknowns, faults: Faults) -> None:
    """Every row takes the values in the middle of the bounds, and every unknown's own paths take its ends."""
    nu = len(unknowns)
    places = [np.full(nu, 0.5)]
    for i in range(nu):
        for end in (0.0, 1.0):
            places.append(np.where(np.arange(nu) == i, end, 0.5))
    for variant in variants:
        driven: dict[str, str] = {}
        for setting in variant.settings:
            driven |= dict.fromkeys(setting.paths, f"unknowns.{setting.name}")
        for target in (*(one.target for one in variant.along), *(target for target, _ in variant.derived)):
            if "." in target and target in driven:
                faults.add(
                    f"{driven[target]}: '{target}' is also set by a table or an expression; set it once"
                )
        for row in variant.rows:
            faults.paths(row.template, float_paths(row.template), variant.driven, f"{row.name}")
        if faults:
            continue
        for n, place in enumerate(places):
            names = unknowns.by_name(place)
            for row in variant.rows if n == 0 else variant.rows[:1]:
                values = variant.values(names, row)
                if not finite(values):
                    bad = [path for path, value in values.items() if not np.isfinite(value)]
                    if n == 0:
                        faults.add(
                            *(f"derived.{path}: has no value in the middle of the bounds" for path in bad)
                        )
                    continue
                own = {p: v for p, v in values.items() if p in driven or p in row.fixed} if n else values
                faults.scene(row.template, own, row.name if n == 0 else "unknowns")
