"""`tarsus design landing`: one line to a header file; and what it says to a bad request."""

from __future__ import annotations

import pytest

LANDING = ("design", "landing", "cantilever", "--foot", "tip")


def test_a_plain_landing_is_written(tarsus, tmp_path):
    done = tarsus(
        *LANDING,
        "--request",
        "effort=0.012",
        "--request",
        "risk=nominal",
        "--request",
        "pairs=1",
        "-o",
        tmp_path / "landing",
        "--json",
    )
    assert done.code == 0, done.err
    table = done.json()
    assert table["speed"] < table["plain"]["speed"]
    assert table["digest"] in (tmp_path / "landing" / "landing.h").read_text()


@pytest.mark.slow
def test_one_line_makes_a_header_a_signal_and_a_page(tarsus, tmp_path, opened):
    folder = tmp_path / "landing"
    done = tarsus(
        *LANDING,
        "--request",
        "levels=free=-8V:8V",
        "--over",
        "robot.feet.tip.gap=69um:71um",
        "--request",
        "effort=0.012",
        "--request",
        "risk=mean",
        "-o",
        folder,
        "--json",
    )
    assert done.code == 0, done.err
    table = done.json()
    assert table["speed"] < table["plain"]["speed"] and table["worst"] >= table["speed"]
    assert {"touchdowns", "switching_times", "energy", "scenarios"} <= set(table)
    written = sorted(path.name for path in folder.iterdir() if not path.name.startswith("."))
    assert written == ["landing.h", "landing.json", "report.html", "scenarios.csv", "scene.toml", "signal.toml"]
    assert opened(folder, "landing design", "`tarsus design landing` wrote it")["speed"] == table["speed"]
    assert table["digest"] in (folder / "landing.h").read_text()
    assert len((folder / "scenarios.csv").read_text().splitlines()) == 1 + len(table["scenarios"])


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--foot", "toe"), "no foot 'toe'"),
        (("--request", "free=signals.pzt.duty"), "no switching time"),
        (("--over", "robot.feet.tip.gap=74um:66um"), "low below high"),
        (("--over", "robot.feet.tip.gap"), "PATH=a:b"),
        (("--over", "a=1:2", "--over", "a=1:3"), "names 'a' twice"),
        (("--request", "levels=-80 V, 80 V"), "beyond the drive's law"),
        (("--set", "robot.feet.tip.gap=1 mm"), "never lands"),
        (("--request", "risk={cvar = 2}", "--over", "robot.feet.tip.gap=66um:74um"), "0 <= q < 1"),
        (("--request", "risk=cvar:0.9", "--over", "robot.feet.tip.gap=66um:74um"), "{cvar = 0.9}"),
        (("--request", "objective=beauty"), "objective"),
        (("--request", "tick=fast"), "tick"),
        (("--foot", "tip", "--request", "foot=toe"), "--request foot: the line itself names it already"),
    ],
)
def test_a_bad_request_gets_one_sentence_and_writes_nothing(tarsus, tmp_path, words, told):
    refused = tarsus(
        "design",
        "landing",
        "cantilever",
        *(() if "--foot" in words else ("--foot", "tip")),
        *words,
        "-o",
        tmp_path / "out",
    )
    assert refused.code == 2 and len(refused.sentences) == 1 and told in refused.sentences[0]
    assert not (tmp_path / "out").exists()


def test_the_printed_request_is_a_file_that_the_verb_takes(tarsus, tmp_path):
    printed = tarsus("design", "request", "landing").out.replace("# foot =", 'foot = "toe"')
    (tmp_path / "own.toml").write_text(printed)
    words = ("design", "landing", "cantilever", "--request", tmp_path / "own.toml", "-o", tmp_path / "out")
    assert "no foot 'toe'" in tarsus(*words).sentences[0]
    assert "pairs" in tarsus(*words, "--request", "foot=tip", "--request", "pairs=9").sentences[0]
    (tmp_path / "own.toml").write_text(printed.replace("effort", "effrt"))
    assert "did you mean 'effort'" in tarsus(*words).sentences[0]
    assert "nothing" in tarsus("design", "request", "nothing").sentences[0]


def test_beside_a_file_of_settings_only_single_ones_may_stand(tarsus, tmp_path):
    own, other = tmp_path / "own.toml", tmp_path / "other.toml"
    own.write_text('scene = "cantilever"\nobjective = "most peak"\n[free]\n"signals.pzt.amplitude" = ["6 V", "8 V"]\n')
    other.write_text("candidates = 64\n")
    refused = tarsus("design", own, "--request", other, "-o", tmp_path / "out")
    assert refused.code == 2 and len(refused.sentences) == 1 and not (tmp_path / "out").exists()
    assert f"--request {other}: '{own}' is the file of settings" in refused.sentences[0]
    words = ("--request", "candidates=64", "--request", "from_rest=60 ms", "--no-report", "--json")
    done = tarsus("design", own, *words, "-o", tmp_path / "out")
    assert done.code == 0 and done.json()["candidates"] == 64 and done.json()["duration"] == 0.06, done.err
