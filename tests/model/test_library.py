from pathlib import Path

import pytest

from tarsus.base.errors import InputError
from tarsus.base.spec import float_paths, get_value
from tarsus.files import installed, library
from tarsus.files.installed import calibration_names, study_names
from tarsus.files.library import device_names, load_scene
from tarsus.files.toml import write_scene
from tarsus.model.drive.waveforms import RampedSquare, Sine, Square
from tarsus.model.scene import Source
from tarsus.study.studyfile import load_sweep


@pytest.mark.parametrize("name", device_names())
def test_every_float_of_a_device_has_provenance(name: str) -> None:
    device = load_scene(name)
    assert device.name == name
    assert device.citations
    for path in float_paths(device):
        origin = device.origin(path)
        assert origin is not None, f"{path} of {name} has no provenance"
        assert len(origin.note.split()) >= 3, f"provenance of {path} is no sentence"
    alone = ("duration", "ground.impact", "ground.landing", "ground.incline")  # choices, with or without a number
    fields = {
        path
        for path in device.provenance
        if path.count(".") >= 2 or path in alone or path.startswith(("gait.", "initial."))
    }
    assert set(device.provenance) == fields, "provenance is given value by value"


def test_the_printed_numbers_of_the_source() -> None:
    device = load_scene("cantilever-1")
    printed = {
        "ground.restitution.coefficient": 0.378,
        "ground.film.thickness": 58e-6,
        "robot.feet.tip.gap": 70e-6,
        "robot.structure.frequencies.0": 623.0,
        "robot.structure.frequencies.1": 6424.0,
    }
    for path, value in printed.items():
        origin = device.origin(path)
        assert get_value(device, path) == pytest.approx(value, rel=1e-15)
        assert origin is not None and origin.source is Source.PRINTED


def test_forces_of_the_source_share_one_calibrated_unit() -> None:
    # Adhesion and film are printed in the force unit of lumped matrices that are not: one factor for all three.
    device = load_scene("cantilever-1")
    printed = {"adhesion.initial": 2.743e-7, "adhesion.rate": 1.700e-6, "film.coefficient": 1.747e-21}
    factors = [get_value(device, f"ground.{path}") / value for path, value in printed.items()]
    assert factors == pytest.approx([factors[0]] * 3, rel=1e-4)
    for path in printed:
        origin = device.origin(f"ground.{path}")
        assert origin is not None and origin.source is Source.CALIBRATED


def test_sugar_for_signals() -> None:
    it = load_scene("cantilever", volts=6, hz="15 Hz", wave="sine")
    assert it.signals["pzt"] == Sine(amplitude=6.0, frequency=15.0)
    same = load_scene("cantilever", volts=6)
    assert same.signals["pzt"] == Square(amplitude=6.0, frequency=50.0)
    ramped = load_scene("cantilever", wave="ramped_square", **{"signals.pzt.duty": "25 %"})
    assert ramped.signals["pzt"] == RampedSquare(amplitude=8.0, frequency=50.0, duty=0.25)
    by_path = load_scene("cantilever", **{"signals.pzt.kind": "sine", "signals.pzt.amplitude": "3 V"})
    assert by_path.signals["pzt"] == Sine(amplitude=3.0, frequency=50.0)


@pytest.fixture
def their_robots(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Another package with devices, a folder of studies and a verb, installed for the length of a test."""
    write_scene(load_scene("cantilever"), tmp_path / "other.toml")
    package = tmp_path / "their_robots"
    (package / "studies").mkdir(parents=True)
    study = 'scene = "other"\nmeasures = ["peak"]\n[vary]\nground.restitution.coefficient = [0.1, 0.2]\n'
    (package / "studies" / "their-sweep.toml").write_text(study)
    (package / "studies" / "their-fit.py").write_text('device = "other"\ntable = "table.csv"\n')
    (package / "__init__.py").write_text(
        f"from pathlib import Path\nOTHER = {str(tmp_path / 'other.toml')!r}\n"
        "STUDIES = Path(__file__).parent / 'studies'\nFUNCTION = 'their_robots.plain:wave'\n"
        'def wave(*, times: int = 1) -> int:\n    """Wave."""\n    print("hello " * times)\n    return 0\n'
    )
    (package / "plain.py").write_text("def wave(times=1):\n    return 'hello ' * times\n")
    info = tmp_path / "their_robots-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: their-robots\nVersion: 1\n")
    (info / "entry_points.txt").write_text(
        "[tarsus.devices]\nother = their_robots:OTHER\nbroken = their_robots:NONE\n"
        "[tarsus.studies]\ntheirs = their_robots:STUDIES\n"
        "[tarsus.commands]\nwave = their_robots:wave\nshow = their_robots:wave\nlost = their_robots:NONE\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    installed._files.cache_clear()
    yield
    installed._files.cache_clear()
    library._device.cache_clear()


def test_devices_of_other_packages(their_robots: None) -> None:
    assert {"other", "broken"} <= set(device_names())
    assert load_scene("other") == load_scene("cantilever")
    with pytest.raises(InputError, match=r"device 'broken' of package .* cannot be loaded"):
        load_scene("broken")


def test_a_folder_of_studies_of_another_package(their_robots: None) -> None:
    assert "their-sweep" in study_names() and "their-sweep" not in calibration_names()
    assert "their-fit" in calibration_names() and "their-fit" not in study_names()
    assert load_sweep("their-sweep").runs == 2
    with pytest.raises(InputError, match="it is a calibration, not a sweep"):
        load_sweep("their-fit")
    with pytest.raises(InputError, match="no study is called 'their-swep'; did you mean 'their-sweep'"):
        load_sweep("their-swep")


def test_verbs_of_other_packages_are_functions_too(their_robots: None, monkeypatch: pytest.MonkeyPatch) -> None:
    import tarsus as ts
    from tarsus_reproduce.verb import reproduce

    assert ts.wave(times=2) == "hello hello "
    monkeypatch.delattr(ts, "wave")
    assert ts.show.__module__ == "tarsus.inspection.show", "the library's own verbs prevail"
    assert "reproduce" in set(dir(ts)) - set(ts.__all__) and ts.reproduce is reproduce, "found by its entry point"
    with pytest.raises(AttributeError, match="no attribute 'reprodcue'"):
        _ = ts.reprodcue


def test_verbs_of_other_packages(their_robots: None, capsys: pytest.CaptureFixture[str]) -> None:
    from tarsus.cli import main

    assert main(["wave", "--times", "2"]) == 0
    said = capsys.readouterr()
    assert said.out.strip() == "hello hello"
    (taken, lost) = sorted(said.err.splitlines(), key=lambda line: "cannot" in line)
    assert "the verb 'show' of their_robots:wave is left out" in taken
    assert "the verb 'lost' of their_robots:NONE cannot be loaded" in lost
    assert main(["--help"]) == 0
    page = capsys.readouterr()
    listed = [line.split()[0] for line in page.out.splitlines() if line.startswith("  ") and line[2:3].strip()]
    assert "wave" in listed and "lost" not in listed
    assert len(page.err.splitlines()) == 2
    assert main(["show", "cantilever", "--json"]) == 0
    assert capsys.readouterr().out.startswith("{")
