"""Several trainings of one recipe as one row, against the equal-step control: what seeds leave of a difference."""

import statistics
from collections.abc import Mapping, Sequence

from diffnav.errors import UserError
from diffnav.evaluation.aggregate import Row, difference, mean_with_interval, rounded
from diffnav.evaluation.cells import with_interval
from diffnav.evaluation.tables import markdown_table

# Method -> picture -> its figure.
Values = Mapping[str, Mapping[str, float]]
_NOTES = (
    "Each picture's mean over the seeds, and its difference to the equal-step control (same start, data, seeds and "
    "steps, matcher weights 0), with 95 % bootstrap intervals over pictures. Gap closed: of the way from gamma_blind "
    "to normal."
)


def require_controls(groups: Mapping[str, Sequence[str]], controls: Mapping[str, str]) -> None:
    """Raise UserError for a group that does not exist or has another number of seeds than its control."""
    for name, control in controls.items():
        for one in (name, control):
            if one not in groups:
                raise UserError(f"controls names {one}, which is no group of seeds; there are {', '.join(groups)}")
        if len(groups[name]) != len(groups[control]):
            raise UserError(
                f"{name} has {len(groups[name])} seeds and its control {control} has {len(groups[control])}; "
                "give as many of both, in the same order"
            )


def seed_rows(
    values: Values,
    groups: Mapping[str, Sequence[str]],
    controls: Mapping[str, str],
    gap: tuple[str, str] = ("gamma_blind", "normal"),
    seed: int = 0,
) -> list[Row]:
    """One plain row per group of methods, the seeds of one recipe, over the pictures that all of them have.

    Args:
        groups: name -> the methods that are its seeds. controls: name of a group -> that of its control, whose seeds
            stand in the same order. gap: methods that count as 0 and as 1 of `gap_closed`.
    Returns: group, seeds, n pictures; mean, mean_ci: of each picture's mean over the seeds; control, difference (mean,
        low, high, paired by picture), percent of the control's mean (None of 0), per_seed (differences of single
        seeds); gap_closed, None where `gap` is not measured or has no width. Intervals: 95 % bootstrap over pictures.
    """
    ends = [values[method] for method in gap if method in values]
    rows = []
    for name, methods in groups.items():
        rivals = groups[controls[name]] if name in controls else []
        pictures = _common([values[method] for method in [*methods, *rivals]] + ends)
        if not pictures:
            continue
        own = _means(values, methods, pictures)
        row: Row = {"group": name, "seeds": len(methods), "n": len(pictures), **mean_with_interval("mean", own, seed)}
        row |= {"control": controls.get(name), "difference": None, "percent": None, "per_seed": None}
        if rivals:
            other = _means(values, rivals, pictures)
            row["difference"] = difference(own, other, seed)
            row["percent"] = rounded(100 * row["difference"][0] / statistics.fmean(other)) if any(other) else None
            row["per_seed"] = [
                rounded(_mean(values[a], pictures) - _mean(values[b], pictures))
                for a, b in zip(methods, rivals, strict=True)
            ]
        row["gap_closed"] = _gap_closed(row["mean"], [_mean(end, pictures) for end in ends])
        rows.append(row)
    return rows


def seed_sections(compared: Mapping[str, Sequence[Row]], digits: int = 1) -> list[str]:
    """Markdown: a heading and a table per score (or matcher); nothing where nothing was compared."""
    if not any(compared.values()):
        return []
    tables = [part for name, rows in compared.items() for part in (f"### {name}", seed_table(rows, digits))]
    return ["## Recipes over their seeds", _NOTES, *tables]


def seed_table(rows: Sequence[Row], digits: int = 1) -> str:
    """The rows of one score as a Markdown table."""
    lines = [
        {
            "recipe": row["group"],
            "seeds": str(row["seeds"]),
            "mean": with_interval(row["mean"], row["mean_ci"], digits),
            "gap closed": "-" if row["gap_closed"] is None else f"{row['gap_closed']:.0%}",
            "control": row["control"] or "-",
            "over its control": "-"
            if row["difference"] is None
            else with_interval(row["difference"][0], row["difference"][1:], digits, "+"),
            "%": "-" if row["percent"] is None else f"{row['percent']:+.1f}",
            "single seeds": ", ".join(f"{d:+.{digits}f}" for d in row["per_seed"] or []) or "-",
            "n": str(row["n"]),
        }
        for row in rows
    ]
    return markdown_table(list(lines[0]), lines)


def _common(sides: Sequence[Mapping[str, float]]) -> list[str]:
    return [name for name in sides[0] if all(name in side for side in sides)]


def _means(values: Values, methods: Sequence[str], pictures: Sequence[str]) -> list[float]:
    """Each picture's mean over the seeds."""
    return [statistics.fmean(values[method][picture] for method in methods) for picture in pictures]


def _mean(own: Mapping[str, float], pictures: Sequence[str]) -> float:
    return statistics.fmean(own[picture] for picture in pictures)


def _gap_closed(mean: float, ends: Sequence[float]) -> float | None:
    if len(ends) < 2 or ends[1] == ends[0]:
        return None
    return rounded((mean - ends[0]) / (ends[1] - ends[0]))
