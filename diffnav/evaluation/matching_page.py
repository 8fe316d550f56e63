"""The matching experiment as a Markdown page: correct matches, a table per matcher, per source, failures, protocol."""

from collections.abc import Mapping, Sequence
from typing import Any

from diffnav.evaluation.aggregate import Row
from diffnav.evaluation.cells import duration, failure_lines, protocol_section, with_interval
from diffnav.evaluation.match_rows import AUC_PX
from diffnav.evaluation.paper_results import NOT_OURS, paper_table_2
from diffnav.evaluation.seeds import seed_sections
from diffnav.evaluation.tables import markdown_table

_KINDS = {
    "rot180": "Queries are darkened, enhanced, then turned by 180 degrees; references are the daylight pictures.",
    "homography": "Queries are darkened and enhanced views of the daylight pictures through random homographies; only "
    "what the picture shows of a view counts.",
    "hpatches": "Queries are images 2 to 6 of each sequence, darkened and enhanced; references are the first images.",
    "lol": "Queries are real dark pictures, enhanced and then seen through random homographies; references are their "
    "bright counterparts.",
}


def matching_page(
    rows: Sequence[Row],
    protocol: Mapping[str, Any],
    left_out: Sequence[str] = (),
    compared: Mapping[str, Sequence[Row]] | None = None,
) -> str:
    """The whole page; `rows` as `matching_rows` makes them, `protocol` any plain values, left_out: sentences.

    compared: matcher -> `seed_rows`, of recipes trained several times.
    """
    kind = rows[0]["pairs"]
    about = [_KINDS.get(kind, ""), *(f"Left out: {sentence}." for sentence in left_out)]
    parts = [f"# Matching: correct matches, pairs={kind}", correct_table(rows), _NOTES, " ".join(about)]
    parts += seed_sections(compared or {})
    for matcher in matchers_of(rows):
        parts += [f"## {matcher}", matcher_table([row for row in rows if row["matcher"] == matcher])]
    if failures := failure_lines(rows):
        parts += ["## Failures", "\n".join(f"- {line}" for line in failures)]
    if any(figures["n"] > 1 for row in rows for figures in row["per_source"].values()):
        parts += ["## By source, correct matches and precision"]
        parts += [sources_table([row for row in rows if row["matcher"] == one], one) for one in matchers_of(rows)]
    parts += ["## The paper's own figures", NOT_OURS, paper_table_2(), _PAPER_NOTES, protocol_section(protocol)]
    return "\n\n".join(parts) + "\n"


def matchers_of(rows: Sequence[Row]) -> list[str]:
    """The matchers, in the order of the rows."""
    return list(dict.fromkeys(row["matcher"] for row in rows))


def correct_table(rows: Sequence[Row]) -> str:
    """Correct matches: one line per method, one column per matcher."""
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        line = lines.setdefault(row["method"], {"method": row["method"]})
        line[row["matcher"]] = with_interval(row["correct"], row["correct_ci"], 1)
        line["s per image"] = duration(row["seconds_enhance"])
        line["n"] = str(row["n"])
    return markdown_table(["method", *matchers_of(rows), "s per image", "n"], list(lines.values()))


def matcher_table(rows: Sequence[Row]) -> str:
    """Everything about one matcher, one line per method."""
    references = [row["method"] for row in rows if any(row["method"] in other["versus"] for other in rows)]
    lines = []
    for row in rows:
        line = {
            "method": row["method"],
            "MP": f"{row['mp']:.1f}",
            "inliers": f"{row['inliers']:.1f}",
            "correct": with_interval(row["correct"], row["correct_ci"], 1),
            "precision": f"{row['precision']:.3f}",
            "inlier ratio": f"{row['inlier_ratio']:.3f}",
            "repeatability": "-" if row["repeatability"] is None else f"{row['repeatability']:.3f}",
            "s enhance": duration(row["seconds_enhance"]),
            "s detect": duration(row["seconds_detect"]),
            "s match": duration(row["seconds_match"]),
            "n": str(row["n"]),
        }
        line |= {f"AUC@{px}": f"{row[f'auc{px}']:.3f}" for px in AUC_PX}
        for name, differences in row["versus"].items():
            mean, *interval = differences["correct"]
            line[f"over {name}"] = with_interval(mean, interval, 1, "+")
        lines.append(line)
    figures = ["precision", "inlier ratio", "repeatability", *(f"AUC@{px}" for px in AUC_PX)]
    columns = ["method", "MP", "inliers", "correct", *(f"over {name}" for name in references), *figures]
    return markdown_table([*columns, "s enhance", "s detect", "s match", "n"], lines)


def sources_table(rows: Sequence[Row], matcher: str) -> str:
    """One line per source, one column per method of one matcher: mean correct matches / precision."""
    lines: dict[str, dict[str, str]] = {}
    for row in rows:
        for source, figures in row["per_source"].items():
            line = lines.setdefault(source, {matcher: source, "n": str(figures["n"])})
            line[row["method"]] = f"{figures['correct']:.1f} / {figures['precision']:.3f}"
    return markdown_table([matcher, "n", *(row["method"] for row in rows)], list(lines.values()))


_NOTES = (
    "Correct: within 3 px of the true position in the reference, each position counted once. In brackets: 95 % "
    "bootstrap interval of the mean over pairs. MP: the matcher's own survivors, right or wrong; inliers: those of a "
    "homography verified by MAGSAC++. Precision and inlier ratio are shares of MP, 0 for a pair without any. "
    "Repeatability: share of covisible keypoints with a counterpart within 3 px. AUC: area under the recall curve of "
    "the verified homography's corner error; none found counts as infinite error. A failure counts with the matches "
    "of the dark input. Differences are paired. Seconds are medians on one thread, while as many processes as the "
    "protocol's workers ran; detection is the query's alone."
)
_PAPER_NOTES = "Its MP counts successful matches, right or wrong; its seconds are enhancement and matching together."
