"""Campaigns that a person writes: defaults, sets like others, patterns; as `synthesize` writes them."""

import tomllib

import numpy as np
import pytest

from identify.campaigns import folder
from tarsus.base.errors import InputError
from tarsus.base.spec import validate
from tarsus.files.toml import description_text
from tarsus.identify.campaign import Campaign, at_points, read_campaign
from tarsus.identify.campaign_file import matching, short_text
from tarsus.records.measurement import Channel, Measurement, Quantity

WRITTEN = """
device = "cantilever"

[defaults]
rest = "10 ms"
drive = "volts"

[records]
slow = {purpose = "ramps", files = "slow-*.mat", signal = {kind = "square", amplitude = "8 V", frequency = "5 Hz"}}
fast = {like = "slow", files = ["fast.mat"], rest = "2 ms", signal = {frequency = "20 Hz"}}

[records.sine]
like = "fast"
files = "s.mat"
purpose = "validation"
signal = { kind = "sine", amplitude = "1 V", frequency = "5 Hz" }
"""


def test_a_set_takes_what_it_does_not_say_from_the_one_it_is_like():
    sets = validate(Campaign, tomllib.loads(WRITTEN)).records
    assert [one.rest for one in sets.values()] == [0.01, 0.002, 0.002]
    assert {one.drive for one in sets.values()} == {"volts"}
    assert [getattr(one.signal, "frequency", None) for one in sets.values()] == [5.0, 20.0, 5.0]
    assert [getattr(one.signal, "amplitude", None) for one in sets.values()] == [8.0, 8.0, 1.0]
    assert sets["sine"].purpose.value == "validation" and sets["sine"].files == ("s.mat",)


@pytest.mark.parametrize(
    ("like", "path"), [("slw", "records.fast.like"), ("fast", "records.fast.like"), ("sine", "records.sine.like")]
)
def test_a_set_that_is_like_none_or_itself_is_refused(like, path):
    with pytest.raises(InputError) as caught:
        validate(Campaign, tomllib.loads(WRITTEN.replace('like = "slow"', f'like = "{like}"')))
    assert [said.partition(":")[0] for said in caught.value.problems] == [path]


def test_patterns_stand_for_the_files_they_match(tmp_path):
    for name in ("a-1.mat", "a-2.mat", "a-10.mat", "b[1].mat", "b1.mat"):
        (tmp_path / name).touch()
    assert matching(tmp_path, ["a-*.mat"]) == ("a-1.mat", "a-2.mat", "a-10.mat")
    assert matching(tmp_path, ["b[1].mat", "c-*.mat"]) == ("b[1].mat", "c-*.mat")


def test_what_synthesize_writes_is_short_and_means_the_same():
    read = read_campaign(folder()).campaign
    sets = {name: one.model_copy(update={"like": None}) for name, one in read.records.items()}
    whole = description_text(read.model_copy(update={"records": sets}))
    short = short_text(tomllib.loads(whole))
    again = validate(Campaign, tomllib.loads(short)).records
    assert short == (folder() / "campaign.toml").read_text()
    assert len(short.splitlines()) < 0.25 * len(whole.splitlines())
    for name, one in again.items():
        assert matching(folder(), one.files) == read.records[name].files
        assert one.model_copy(update={"like": None, "files": ()}) == sets[name].model_copy(update={"files": ()})


def test_degrees_of_freedom_are_the_points_that_scenes_name_after_them():
    names = ("1+Z", "2-Z", "3+Z", "volts")
    quantities = (Quantity.VELOCITY,) * 3 + (Quantity.VOLTAGE,)
    channels = tuple(Channel(name, one, name) for name, one in zip(names, quantities, strict=True))
    record = at_points(Measurement(channels, np.arange(8.0).reshape(4, 2), 1e-3), ("1_Z", "2_Z"))
    assert [one.at for one in record.channels] == ["1_Z", "2_Z", "3+Z", "volts"]
    assert record.names == names
    assert record["2-Z"].tolist() == [-2.0, -3.0] and record["3+Z"].tolist() == [4.0, 5.0]
