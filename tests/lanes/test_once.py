"""What is made once for all workers."""

import tempfile

from once import once


def test_a_second_worker_reads_what_the_first_made(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTEST_XDIST_TESTRUNUID", "run")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    made = []

    def make() -> list[int]:
        made.append(1)
        return made

    first, second = once(make), once(make)
    assert first() == second() == made == [1] and first() is first() is not second()
