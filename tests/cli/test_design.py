"""`tarsus design landing`: one line to a header file; and what it says to a bad request."""

from __future__ import annotations


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
