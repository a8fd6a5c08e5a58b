"""`tarsus bench`: the engine's speed here, after its event sequences were checked."""

from __future__ import annotations

from tarsus.cli.options import Json


def bench(*, json: Json = False) -> int:
    """Time the engine on the reference problems; whole event sequences are checked before a time is printed."""
    from tarsus.cli import console
    from tarsus.study.bench import run_bench
    from tarsus.tables.table import Table

    with console.progress_bar("timing") as progress:
        result = run_bench(progress)
    if json:
        console.print_json(result)
    else:
        console.table(Table("", ("figure", "value"), result.items()))
    wrong = {name: value for name, value in result.items() if name.endswith("_wrong") and value}
    if wrong:
        console.complain(
            [
                f"{name.removesuffix('_wrong')}: {value:g} events or counts are wrong"
                for name, value in wrong.items()
            ]
        )
    return 1 if wrong else 0
