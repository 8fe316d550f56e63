"""What one method's picture of one query had in common with every reference, on disk as it comes."""

from dataclasses import dataclass, field

from diffnav.driving.answers import most_accepted, most_matches

# How references are ranked: by the paper's most matches, by inliers of a fundamental matrix, or, for rectified cameras,
# by matches that keep their row.
RANKINGS = ("matches", "inliers", "rows")


@dataclass(frozen=True)
class DrivingRecord:
    """One query, as one method shows it, with one matcher.

    key: of everything that decides the rest. truth: number of the partner among the references. counts: matches with
    each reference, -1 for one that the shortlist left out. inliers, rows: [reference, count] of those verified.
    seconds_enhance, _features, _match, _verify: what each stage took, None where it failed. gamma: of the darkening.
    failure: why there is no picture or no answer.
    """

    key: str
    method: str
    matcher: str
    name: str
    record: str
    truth: int
    counts: list[int] = field(default_factory=list)
    inliers: list[list[int]] = field(default_factory=list)
    rows: list[list[int]] = field(default_factory=list)
    gamma: float | None = None
    seconds_enhance: float | None = None
    seconds_features: float | None = None
    seconds_match: float | None = None
    seconds_verify: float | None = None
    failure: str | None = None

    def answer(self, ranking: str) -> int | None:
        """The number of the reference that wins by `RANKINGS`; None where nothing matched."""
        if ranking == "matches":
            return most_matches(self.counts)
        return most_accepted(self.counts, {one[0]: one[1] for one in self.accepted(ranking)})

    def accepted(self, ranking: str) -> list[list[int]]:
        """[reference, matches that geometry accepts] of those verified, for a ranking by geometry."""
        return {"inliers": self.inliers, "rows": self.rows}[ranking]

    @property
    def seconds(self) -> float | None:
        """From the dark picture to the answer; without verification, which is a ranking's own."""
        stages = (self.seconds_enhance, self.seconds_features, self.seconds_match)
        return None if None in stages else sum(stage for stage in stages if stage is not None)
