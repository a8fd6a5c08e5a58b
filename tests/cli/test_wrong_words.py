"""Every verb, asked for what cannot be: a sentence and exit code 2, before anything is simulated or written."""

from __future__ import annotations

import os
import re
import shlex

import pytest

from tarsus.cli import app

ATLAS = "atlas cantilever -o out --x robot.feet.tip.gap=60um:80um"
SCATTER = "yield millipede --scatter robot.drives.*.law.gain=5%"
LAND = "design landing cantilever --foot tip -o out"
RANK = "recommend cantilever --parameter ground.adhesion.rate --budget"

CLASS = re.compile(r"\b[A-Z][a-z]+\w*\.[a-z]")

KINDS = {"scene": "simulate", "sweep": "sweep", "campaign": "identify", "calibration": "calibrate"}
"""Kinds of files by name, and the verb that takes each."""

WRONG = [
    ("simulat cantilever", 'Did you mean "simulate"'),
    ("simulate", "SCENE is missing. See `tarsus simulate --help`."),
    ("simulate cantilever --set", "--set takes a value."),
    ("simulate cantilever hexapod", "unexpected: hexapod."),
    ("simulate cantilever --lenght 3", "Unknown option: --lenght"),
    ("simulate cantilever --set gap=1um", "did you mean 'robot.feet.tip.gap'?"),
    ("simulate cantilever --set 'ground.film.thickness=70 mg'", "ground.film.thickness: expected a length (m)"),
    ("simulate cantilever --set ground.film.thickness", "--set takes NAME=VALUE"),
    ("simulate cantilever --set volts=6 --set volts=8", "--set names 'volts' twice"),
    ("simulate cantilever --set wave=sqare", "square"),
    ("simulate cantilever --duration=-3s", "--duration: expected a time above 0 s, got -3 s"),
    ("simulate cantilever --duration=nan", "duration"),
    ("simulate cantilever --duration 1e300s", "the longest run is about"),
    ("simulate cantilever --law none.py", "none.py: no such law file"),
    ("simulate cantilever --law raises.py", "raises.py, line 2: RuntimeError: boom"),
    ("simulate cantilever -o taken/below", "is a file, a folder is needed"),
    ("simulate cantilever --seed 1", "this verb has no --seed. See `tarsus simulate --help`."),
    ("simulate cantilever --set hz=5 Hz", "unexpected: Hz (a value with a blank stands in quotes)."),
    ("simulate cantilever --mat", "--mat writes into the run's folder: name one with -o"),
    ("-q devices -v", "one of them"),
    ("devices x", "unexpected: x"),
    ("bench x", "unexpected: x"),
    ("doctor x", "unexpected: x"),
    ("completion ksh", 'Did you mean "zsh"?'),
    ("show folder", "'folder' is a folder that holds no result of tarsus"),
    ("show run", "it holds scene.toml: give 'run/scene.toml'"),
    ("show none.csv", "no such file"),
    ("show made nowhere", "no device is called 'nowhere'"),
    ("show made --drive pzt", "drive: is of a record, and 'made' is a run"),
    ("show taken", "holds no rows of numbers"),
    ("show shown.html", "'shown.html' is a page: open it in a browser"),
    ("show mixture.json", "'mixture.json' is a part of a result at most: give its folder"),
    ("show cantilever taken", "compare two runs, or two devices or scene files"),
    ("show cantilever cantilver", "did you mean 'cantilever'?"),
    ("check bytes.toml", "bytes.toml: is no text file"),
    ("check .", "holds no result of tarsus"),
    ("new spaceship x.toml", 'Choose from: "device"'),
    ("new device taken", "a device is a .toml file"),
    ("new device mine.toml --legs 0", "--legs: expected a number from 1 to 40, got 0"),
    ("new device mine.toml --legs 4 --mass 3mm", "--mass: expected a mass (kg), got '3mm', which is a length"),
    ("new device mine.toml --mass 1g", "--legs and --mass: they make a new device"),
    ("new law mine.py --device cantilever", "a law belongs to no device"),
    ("new campaign folder", "holds no records"),
    ("new device mine.toml --legs 4 --mass -1g", "--mass: expected a mass (kg) above 0, got '-1g'"),
    ("new campaign made", "'made' is no folder of records; it holds a run (`tarsus simulate` wrote it)"),
    ("new campaign nowhere", "is no folder"),
    ("report nowhere", "is no folder"),
    ("report folder", "holds no run and no page"),
    ("plot cantilever -o x.png", "name a folder that `simulate` or `sweep` wrote"),
    ("plot nowhere -o a.png", "there is no 'nowhere'"),
    ("plot folder -o x.jpg", "ending in .png"),
    ("plot folder -o folder", "'folder' is a folder"),
    ("plot . -o a.png", "holds no run and no finished sweep"),
    ("plot made/scene.toml -o a.png", "is no NetCDF file of tarsus"),
    ("plot made gapp -o a.png", "did you mean 'gap'?"),
    ("plot made gap --only tipp -o a.png", "did you mean 'tip'?"),
    ("plot made ledger --only tip -o a.png", "--only names points"),
    ("plot made kinetic_energy --only tip -o a.png", "no names to choose from"),
    ("plot made --over robot.feet.tip.gap -o a.png", "--over is for batches and sweeps"),
    ("movie millipede -o x.mp4", "ending in .gif"),
    ("movie millipede -o x.gif --periods 0", "periods: expected 1 or more, got 0"),
    ("movie millipede -o x.gif --width 9", "width: expected 100 to 4096 pixels, got 9"),
    ("movie made -o x.gif --set volts=3", "--set is for a device or scene: a folder's run is over"),
    ("movie made -o x.gif --duration 1s", "a duration is for a device or scene: this run is over"),
    ("modes bare.csv", "give it with --read NAME=UNIT"),
    (
        "modes bare.csv --read b=m/s --read axis=a --read axis_unit=s",
        "name it (--drive), or say that these are free decays (--decay)",
    ),
    ("modes bytes.toml", "bytes.toml is a description (TOML), no record"),
    ("modes driven.csv --drive volt", "drive: no record has a channel 'volt'; did you mean 'volts'?"),
    ("modes driven.csv --order 100000", "order: expected a number from 2 to 300, got 100000"),
    ("modes empty.csv --segment -1s", "segment: expected a time above 0 s, got −1 s"),
    ("modes empty.csv --band a:b", "band: expected a frequency (Hz), got 'a'"),
    ("modes empty.csv --band 500:100", "band: expected a lower and a higher frequency, got 500 Hz and 100 Hz"),
    ("modes driven.csv --against mixture.json", "--against: mixture.json is no modes.json of `tarsus modes`"),
    ("modes driven.csv --against taken", "taken is damaged: it is no JSON"),
    ("modes empty.csv --band 500", "--band takes both ends of a range, a:b, got '500'"),
    ("sweep cantilever-adhesoin", "did you mean 'cantilever-adhesion'?"),
    ("sweep ./made", "expected a study by name, or a study file (.toml); it holds a run (`tarsus simulate` wrote it)"),
    ("simulate cantilever --set robot.feet.tip.gap=70,5um", "decimals begin with a point, not with a comma"),
    ("calibrate empty.csv", "does not end in .py: expected a calibration by name, or a study file (.py)"),
    ("sweep cantilever", "it is a calibration, not a sweep"),
    ("sweep cantilever-adhesion --array 0", "array: expected a number of tasks of 1 or more, got 0"),
    ("sweep cantilever-adhesion --sbatch=-p", "sbatch: these are options of an array"),
    ('sweep cantilever-adhesion --array 2 --sbatch "--comment=\'x"', "sbatch: '--comment='x' cannot be read"),
    ("sweep cantilever-adhesion --threads 0", "--threads: expected a number of 1 or more, got 0"),
    ("yield millipede --scatter ground.friction.coefficient", "--scatter takes NAME=VALUE, got 'ground.fr"),
    ("yield millipede --over ground.friction.coefficient=1", "PATH=a:b, such as robot.feet.tip.gap=66um:74um, got 'gr"),
    ("yield millipede --over ground.friction.coefficient=5:1", "coefficient: the range from 5 to 1 is empty"),
    ("yield millipede --scatter robot.drives.*.law.gain=-5%", "a standard deviation of 0 or more, got '-5%'"),
    (f"{SCATTER} -o run --resume", "'run' holds no yield to continue: it has scene.toml but no robots"),
    (f"{SCATTER} --weak 0:x", "--weak takes two whole numbers, fewest:most, got '0:x'"),
    (f"{SCATTER} --weak 2", "--weak takes two whole numbers, fewest:most, got '2'"),
    (f"{SCATTER} --weak 1:2 --weakness 150%", "weakness: expected a number of at most 1, got 1.5"),
    ("yield millipede --dead 2:0", "dead, weak: expected fewest:most of at least 0, got 2:0"),
    (f"{SCATTER} --robots 0", "robots: expected a whole number of at least 1, got 0"),
    (
        f"{SCATTER} --from-rest 1us --duration 1s",
        "duration: an episode is as long as --from-rest says; give one of the",
    ),
    (f"{SCATTER} --duration 10ms", "from the scene's own start is --from-rest '10 ms'"),
    ("yield cantilever --over ground.restitution.coefficient=0.3:0.5 --draws 4", "draws: Sobol indices compare"),
    ("branch cantilever --along signals.pzt.amplitude=8V:4V --multiple 0", "multiple: expected a number of drive per"),
    ("explore nowhere -o page.html", "no device is called 'nowhere'"),
    ("export cantilever --to stl -o folder", "mjcf"),
    ("export cantilever --to matlab --step 1us -o folder", "step: a model for MATLAB has none"),
    ("attractors ./folder", "is a folder: expected a device by name, or a scene file (.toml)"),
    ("attractors millipede --starts 0", "--starts: expected 1 or more, got 0"),
    ("attractors millipede --starts 2.5", "--starts: expected a whole number, got '2.5'"),
    ("recommend ./run --budget 2s", "or a scene file (.toml); it holds scene.toml"),
    (f"{RANK} -1s", "budget: expected a time above 0 s"),
    (f"{RANK} 1s --spread=-5%", "spread: expected a share above 0, got -5%"),
    (f"{RANK} 1s --draws none.npz", "none.npz: no such file"),
    (f"{RANK} 1s --draws taken", "taken holds no draws of an identification; expected a draws.npz"),
    (f"{RANK} 1s --vary hz=5,x", "hz: expected a frequency (Hz), got 'x'"),
    (f"{ATLAS} --y signals.pzt.amplitude=4V:8V --on moon", "--on: no scheduler answers at 'moon'"),
    ("atlas cantilever -o out", "x, y: expected both axes of the scene's map"),
    ("atlas cantilever-gap-map -o out --set robot.feet.tip.gap=3mg", "which is a mass"),
    ("atlas cantilever-gap-map --resume", "--resume continues what a folder holds: name it with -o"),
    ("atlas cantilever-gap-map --periods 0", "periods: expected 1 or more, got 0"),
    ("synthesize cantilever -o out --perturb '120 %'", "expected a perturbation from 0 to below 1, got 1.2"),
    ("synthesize cantilever -o out --perturb 1.5", "expected a perturbation from 0 to below 1, got 1.5"),
    ("synthesize cantilever-capture -o out --snr-db nan", "--snr-db: expected a finite number"),
    ("identify folder", "tarsus new campaign"),
    ("identify made", "made/campaign.toml: no such file; it holds a run (`tarsus simulate` wrote it)"),
    ("identify driven.csv", "no campaign file"),
    ("identify folder --track", "--track: name the campaigns that were recorded later"),
    ("calibrate millipede", "no calibration is called 'millipede', which is a device; valid names are 'cantilever'"),
    ("calibrate cantilever --seed -1", "--seed: expected a number of 0 or more, got -1"),
    ("calibrate cantilever --resume --overwrite -o x", "give one of them"),
    (f"{LAND} --request 'risk={{cvar = 2}}' --over robot.feet.tip.gap=66um:74um", "0 <= q < 1"),
    (f"{LAND} --request risk=cvar:0.9 --over robot.feet.tip.gap=66um:74um", "{cvar = 0.9}"),
    (f"{LAND} --limits 'peak<1mm'", "Unknown option: --limits"),
    (f"{LAND} --request foot=toe", "--request foot: the line itself names it already"),
    ("design gait millipede-printed --free gait.duty=1 -o out", "--free gait.duty=a:b takes"),
    ("design kinds/sweep.toml -o out", "it is a sweep, not a design to be searched: `tarsus sweep` takes it"),
    ("design nothing", "'nothing' is no file of a design (.toml); `tarsus new design FILE.toml` writes one"),
    ("design made", "'made' is no file of a design (.toml); it holds a run"),
    ("reproduce", "name an experiment (cantilever, "),
    ("reproduce --all", "give it with -o"),
    ("reproduce hexapod --all -o x", "leave 'hexapod' out"),
    ("reproduce --all -o x --device mine", "--device belongs to one experiment"),
    ("reproduce hexapod --rows nowhere.csv", "nowhere.csv: no such file"),
    ("reproduce cantilever --rows folder", "folder: cannot be read: is a directory"),
    ("validate", "name an experiment (ball-bounces, ball-drop"),
    ("validate ball-drop --all", "--all means every experiment: leave 'ball-drop' out"),
    ("validate folder", "the folder holds no claims.toml"),
    *(
        (f"{verb} kinds/{other}.toml -o out", f"toml: it is a {other}, not a {kind}: `tarsus {KINDS[other]}` takes it")
        for kind, verb in KINDS.items()
        for other in KINDS
        if other != kind
    ),
]

OF_A_KIND = {
    "scene": 'name = "x"\n[robot]\n',
    "sweep": 'scene = "cantilever"\n[vary]\n"robot.feet.tip.gap" = [1e-6]\n',
    "calibration": 'device = "cantilever"\ntable = "x.csv"\n',
    "campaign": 'device = "cantilever"\n[records.a]\n',
}
FILES = {
    "taken": "x",
    "mixture.json": "{}",
    "shown.html": "",
    "empty.csv": "",
    "driven.csv": "t [s],volts [V],tip [m/s]\n" + "".join(f"{k / 1e3},{k % 7 % 3},{k % 5}\n" for k in range(400)),
    "bare.csv": "a,b\n0,1\n1,2\n2,3\n",
    "raises.py": "x = 1\nraise RuntimeError('boom')\n",
}


def test_every_verb_is_asked_for_something_wrong():
    verbs = {words.split()[0] for words, _ in WRONG}
    assert verbs >= {*app.VERBS, "reproduce"}


@pytest.mark.parametrize(("words", "said"), WRONG, ids=[words for words, _ in WRONG])
def test_what_cannot_be_is_refused_in_a_sentence(tarsus, tmp_path, monkeypatch, simulated, words, said):
    monkeypatch.chdir(tmp_path)
    if "made" in words:
        (tmp_path / "made").symlink_to(simulated)
    for name in ("folder", "run"):
        (tmp_path / name).mkdir()
    (tmp_path / "run" / "scene.toml").touch()
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    if "kinds" in words:
        (tmp_path / "kinds").mkdir()
        for name, text in OF_A_KIND.items():
            (tmp_path / "kinds" / f"{name}.toml").write_text(text, encoding="utf-8")
    (tmp_path / "bytes.toml").write_bytes(b"\xca\xfe\xba\xbe")
    before = sorted(tmp_path.rglob("*"))
    refused = tarsus(*shlex.split(words))
    assert (refused.code, refused.out) == (2, "")
    assert any(said in one for one in refused.sentences), refused.err
    assert not CLASS.search(refused.err), "a class of the library is no word of the command line"
    assert sorted(tmp_path.rglob("*")) == before


def test_all_that_is_wrong_is_said_at_once(tarsus, magnet):
    law = ("--law", magnet, "--set", "ground.laws.magnet.strenght=3")
    said = tarsus("simulate", "cantilever", *law, "--set", "ground.laws.magnet.offset=0")
    assert said.code == 2 and len(said.sentences) == 2
    assert "did you mean 'strength'" in said.err and "above 0" in said.err


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="the superuser may write anywhere")
def test_an_output_folder_that_is_not_writable(tarsus, tmp_path):
    folder = tmp_path / "closed"
    folder.mkdir(mode=0o500)
    said = tarsus("simulate", "cantilever", "-o", folder / "out")
    assert said.code == 2 and "not writable" in said.sentences[0]
