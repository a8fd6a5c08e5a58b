"""The engine compiled for pages, run by Node: the same events as natively, and what stops it is told in words.

A lane of its own, ``pytest -m wasm``: it compiles, with ziglang, what nobody has compiled yet, and fails without
that and without Node.
"""

from __future__ import annotations

import json
import shlex
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import tarsus as ts
import tarsus.core.page
from doc_pages import PAGES
from tarsus.cli import main
from tarsus.core import _native
from tarsus.core.arrays import EVENT_WIDTH
from tarsus.solve.explored import Explored
from tarsus.solve.packet import packed, packet_arrays, packet_of
from tarsus.solve.page_engine import compiled_engine
from tarsus.solve.run import Shared, prepared

pytestmark = pytest.mark.wasm
PAGE = Path(tarsus.core.page.__file__).parent
SECONDS, FRAMES = 0.05, 50
TIMES = f"const times = Array.from({{length: {FRAMES}}}, (_, n) => {SECONDS} * n / {FRAMES - 1});"
LOAD = """
const fs = require('fs'), [folder, ...rest] = process.argv.slice(2);
const Engine = new Function(fs.readFileSync(%s, 'utf8') + '; return Engine')();
const wasm = new WebAssembly.Module(fs.readFileSync(folder + '/engine.wasm'));
const packet = (name) => new Uint8Array(fs.readFileSync(folder + '/' + name)).buffer;
const found = (() => { %s })();
console.log(JSON.stringify(found, (key, value) => ArrayBuffer.isView(value) ? Array.from(value) : value));
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("engine")
    (made / "engine.wasm").write_bytes(compiled_engine())
    return made


def in_node(folder, script):
    """What a script gives that has `Engine`, the compiled module `wasm` and `packet(name)`."""
    node = shutil.which("node")
    assert node, "this lane needs Node on the path"
    (folder / "script.js").write_text(LOAD % (json.dumps(str(PAGE / "engine.js")), script))
    done = subprocess.run([node, folder / "script.js", folder], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr[-2000:]
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", ["cantilever", "hexapod", "mems-switch", "quadruped", "millipede", "millipede-30"])
def test_events_are_those_of_the_module_for_python(folder, name):
    packet = packet_of(ts.load_scene(name), SECONDS, ts.Accuracy())
    (folder / f"{name}.bin").write_bytes(packet)
    code, finish, events, samples, marks, _ = _native.Packaged(packet).run(np.linspace(0.0, SECONDS, FRAMES))
    found = in_node(folder, f"{TIMES} return new Engine(wasm, packet('{name}.bin')).run(times)")
    rows = np.array(found["events"], dtype=float).reshape(-1, EVENT_WIDTH)
    assert found["code"] == code and found["finish"][0] == finish[0]
    np.testing.assert_array_equal(rows[:, 1:3], events[:, 1:3])
    np.testing.assert_allclose(rows[:, 0], events[:, 0], rtol=0.0, atol=1e-9 * SECONDS)
    there = np.array(found["samples"], dtype=float).reshape(FRAMES, found["width"])
    size = np.abs(samples).max(axis=0)
    assert there.shape == samples.shape and len(found["marks"]) == len(marks)
    np.testing.assert_allclose(there, samples, rtol=0.0, atol=1e-6 * size.max())


def test_memory_does_not_grow_with_runs(folder):
    (folder / "hexapod.bin").write_bytes(packet_of(ts.load_scene("hexapod"), 0.01, ts.Accuracy()))
    found = in_node(
        folder,
        "const times = Array.from({length: 100}, (_, n) => n / 9900);"
        "const e = new Engine(wasm, packet('hexapod.bin')), own = e.array('rows.sources')[0], seen = [];"
        "for (let n = 0; n < 400; n++) {"
        "  e.array('rows.sources')[0] = own * (1 + n % 40 / 40); seen.push(e.run(times).memory); }"
        "return [seen[100], seen[399]]",
    )
    assert found[0] == found[1]


def test_what_stops_the_engine_is_told_and_it_goes_on(folder):
    """A contact that the packet lacks stops a run; the engine is then made anew and runs."""
    scene = ts.load_scene("cantilever")
    engine, rows = prepared(scene, {}, SECONDS, Shared())
    arrays = packet_arrays(scene, engine, rows, ts.Accuracy())
    (folder / "lacking.bin").write_bytes(
        packed({name: of for name, of in arrays.items() if not name.startswith("mode.1")})
    )
    found = in_node(
        folder,
        "const e = new Engine(wasm, packet('lacking.bin')), said = [], drive = e.array('rows.sources');"
        "for (const gap of [7e-5, 1.0]) { e.array('rows.sources')[0] = gap;"
        "  try { said.push(e.run([0]).code); } catch (error) { said.push(error.message); } }"
        "try { new Engine(wasm, new ArrayBuffer(64)); } catch (error) { said.push(error.message); } return said",
    )
    assert found == ["the packet lacks the contact mode.1", 0, "this is no packet of a plan"]


def test_a_run_that_cannot_start_says_why(folder):
    scene = ts.with_values(ts.load_scene("millipede"), {"ground.adhesion.initial": 0.0})
    (folder / "millipede.bin").write_bytes(packet_of(scene, SECONDS, ts.Accuracy()))
    found = in_node(
        folder,
        "const e = new Engine(wasm, packet('millipede.bin')), sources = e.array('rows.sources');"
        "sources[sources.length - 2] = -1; return e.run([0])",
    )
    faults = np.array(found["refusals"]).reshape(-1, 4)
    assert found["code"] == -1 and {_native.FAULTS[int(one)] for one in faults[:, 1]} == {"pulled down"}


ROWS = {"cantilever": 16, "hexapod": 14, "mems-switch": 8, "quadruped": 6, "ball-on-table": 6, "millipede": 8}
"""Rows of every device, their sliders put anywhere."""


def alike(events, others):
    """Whether every foot has the same events to 1e-9 s; those of two feet at one moment may be in either order."""
    events, others = (rows[np.argsort(rows[:, 1], kind="stable")] for rows in (events, others))
    same = events.shape == others.shape and np.array_equal(events[:, 1:3], others[:, 1:3])
    return same and np.abs(events[:, 0] - others[:, 0]).max(initial=0.0) < 1e-9


@pytest.mark.parametrize("name", ROWS)
def test_measures_are_those_of_the_library(folder, name):
    """All that the page shows of a run is what `simulate` says of the scene with the sliders' values;
    events may part only where a number changed by rounding parts them natively too."""
    explored = Explored.of(ts.load_scene(name), 0.1 if name != "mems-switch" else 0.008)
    (folder / "row.bin").write_bytes(explored.packet)
    rng, rows, wanted, turned = np.random.default_rng(len(name)), [], [], []
    for _ in range(ROWS[name]):
        values = {}
        for one in explored.sliders:
            share = rng.uniform()
            stops = one.stops or (one.low + share * (one.high - one.low),)
            values[one.paths[0]] = float(stops[int(share * len(stops))])
        turned.append(values)
        rows.append({key: np.asarray(of).tolist() for key, of in explored.row(values).items()})
        run = ts.simulate(explored.changed(values), explored.seconds)
        measured = [run.measures[key] for key in explored.measures]
        wanted.append((run.motion.log.events, [(one.value, one.spread, one.n) for one in measured]))
    (folder / "rows.json").write_text(json.dumps(rows))
    found = in_node(
        folder,
        "const e = new Engine(wasm, packet('row.bin')), text = fs.readFileSync(folder + '/rows.json', 'utf8');"
        "const rows = JSON.parse(text.replaceAll('NaN', 'null'));"
        "return rows.map((row) => { for (const [name, of] of Object.entries(row)) {"
        "  const to = e.array(name), put = to instanceof BigInt64Array ? BigInt : (v) => v ?? NaN;"
        "  of.forEach((v, k) => { to[k] = put(v); }); }"
        "  const { events, measures } = e.run([0, e.duration], true); return [events, measures]; })",
    )
    met = 0
    for values, (events, measures), (own, expected) in zip(turned, found, wanted, strict=True):
        if not alike(np.array(events, dtype=float).reshape(-1, EVENT_WIDTH), own):
            near = {one.paths[0]: values[one.paths[0]] * (1.0 + 1e-13) for one in explored.sliders if one.array}
            moved = explored.changed(values | near)
            assert not alike(ts.simulate(moved, explored.seconds).motion.log.events, own), values
        else:
            met += 1
            there = np.array(measures, dtype=float).reshape(-1, 3)
            size = np.abs([value for value, _, _ in expected])[:, None] * [0.0, 1e-7, 0.0]  # spreads may be rounding
            near = np.isclose(there, expected, rtol=1e-7, atol=np.nan_to_num(size), equal_nan=True)
            assert near.all(), (np.array(explored.measures)[~near.all(axis=1)], there[~near], np.array(expected)[~near])
    assert met >= len(wanted) // 2


def test_the_command_lines_of_the_documentation_write_pages(folder, tmp_path, monkeypatch):
    wasm = (folder / "engine.wasm").read_bytes()
    for home in ("report.explorer", "solve.page_engine"):
        monkeypatch.setattr(f"tarsus.{home}.engine_bytes", lambda: wasm)
    monkeypatch.chdir(tmp_path)
    lines = [line for line in PAGES["explore.md"].splitlines() if line.startswith("tarsus explore")]
    for line in lines:
        assert main([*shlex.split(line)[1:], "-q"]) == 0
    sizes = [(tmp_path / line.split()[-1]).stat().st_size for line in lines]
    assert len(lines) == 2 and max(sizes) < 1_500_000
    assert main(["simulate", "cantilever", "--duration", "20 ms", "-o", "out", "-q"]) == 0
    assert main(["simulate", "cantilever", "--duration", "20 ms", "-o", "plain", "--static", "-q"]) == 0
    text, plain = ((tmp_path / name / "report.html").read_text(encoding="utf-8") for name in ("out", "plain"))
    assert text.count('class="explore"') == 1 and plain.count('class="explore"') == 0
