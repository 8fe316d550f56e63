"""Where a track is interrupted."""

from example_fixes import fix, lost

from diffnav.navigation.exports.segments import track_segments


def names(segments):
    return [[one.query for one in segment] for segment in segments]


def test_flights_are_kept_apart():
    fixes = [fix("a1", flight="a"), fix("a2", flight="a"), fix("b1", flight="b"), fix("b2", flight="b")]
    assert names(track_segments(fixes)) == [["a1", "a2"], ["b1", "b2"]]


def test_pictures_of_no_flight_stand_alone():
    assert names(track_segments([fix("1", flight=""), fix("2", flight="")])) == [["1"], ["2"]]


def test_one_lost_picture_is_bridged_two_are_not():
    fixes = [fix("1"), lost("2"), fix("3"), lost("4"), lost("5"), fix("6")]
    assert names(track_segments(fixes)) == [["1", "3"], ["6"]]
