"""The legend of the HTML map: colours, counts, the maps to go to, and the pictures without a place."""

from collections.abc import Mapping, Sequence
from html import escape

from diffnav.navigation.exports.fields import clean, place_of
from diffnav.navigation.fix import Fix

COLOURS = {"fix": "#1f6fd6", "coasted": "#e08214", "truth": "#1a9850", "error": "#d62728"}
_NAMES = {
    "fix": "fix, and its footprint",
    "coasted": "coasted",
    "truth": "truth",
    "error": "error",
}
_STYLE = """<style>
.legend { position: fixed; left: 10px; bottom: 65px; z-index: 1000; background: #fffe; border-radius: 5px;
  padding: 8px 12px; font: 13px/1.5 system-ui, sans-serif; box-shadow: 0 1px 5px #0006; max-width: 24rem; }
.legend i { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 7px; }
.legend div.list { max-height: 30vh; overflow: auto; }
table.known th { text-align: left; font-weight: 400; color: #666; padding-right: 8px; vertical-align: top; }
</style>"""


def legend_html(fixes: Sequence[Fix], truths: Mapping[str, tuple[float, float]], maps: Sequence[str]) -> str:
    """The legend as HTML; names are escaped. Links to maps carry their number in `data-view`."""
    counts = {
        "fix": sum(fix.status == "fix" and place_of(fix) is not None for fix in fixes),
        "coasted": sum(fix.status == "coasted" and place_of(fix) is not None for fix in fixes),
        "truth": sum(fix.query in truths for fix in fixes),
        "error": sum(fix.query in truths and place_of(fix) is not None for fix in fixes),
    }
    lines = [
        f'<div><i style="background:{COLOURS[kind]}"></i>{_NAMES[kind]}: {count} of {len(fixes)}</div>'
        for kind, count in counts.items()
        if count or kind == "fix"
    ]
    lines.append("<div>circle: one standard deviation</div>")
    lost = [fix for fix in fixes if place_of(fix) is None]
    if lost:
        entries = "".join(
            f"<div>{_text(fix.query)}: {_text('; '.join(fix.reasons)) or 'no reason'}</div>" for fix in lost
        )
        lines.append(f'<details><summary>no fix: {len(lost)}</summary><div class="list">{entries}</div></details>')
    if len(maps) > 1:
        links = "".join(f'<div><a href="#" data-view="{k}">{_text(name)}</a></div>' for k, name in enumerate(maps))
        lines.append(f'<details open><summary>go to</summary><div class="list">{links}</div></details>')
    return f'{_STYLE}<div class="legend">{"".join(lines)}</div>'


def _text(value: str) -> str:
    return escape(clean(value))
