"""A benchmark's figures as a page of Markdown tables."""

from collections.abc import Mapping
from typing import Any

from diffnav.evaluation.tables import markdown_table
from diffnav.evaluation.timing import PHASES


def benchmark_page(result: Mapping[str, Any]) -> str:
    """The page of what `run_benchmark` returns."""
    environment, settings, large = result["environment"], result["settings"], result["large_image"]
    packages = ", ".join(f"{name} {version}" for name, version in environment["versions"].items())
    load = environment["load_before"]
    busy = "" if load is None else f" Load of the machine before the run: {load:.1f}."
    parts = [
        "# Benchmark",
        f"Device: {environment['device']}. CPU: {environment['cpu']}, {environment['cores']} cores.{busy}",
        f"{packages}.",
        f"All cases took turns, {settings['repeats']} times each; medians. Read the ratios: they hold on other "
        "machines better than seconds do.",
        "## A training step",
        f"{settings['batch']} patches of {settings['patch']} x {settings['patch']}. Ratio: time over the first row's. "
        "Of the paper's: over the same step with the paper's losses alone. "
        "Outside: the share of data and other. Backward holds the gradient's check and clipping. "
        "Peak: memory of a process that takes such steps, Python and libraries included.",
        _training_table(result),
        "## Inference",
        f"One picture of {_wh(result['inference'][0]['size'])}. Ratio: time over the first row's. "
        "Eager float32 / this: over the same network in float32 by torch as it is; compiling does not count.",
        _inference_table(result),
        *(f"{sentence}." for sentence in result["left_out"]),
        "## A large picture",
        f"{large['name']}, {_wh(large['size'])} in tiles of at most {large['tile_pixels']:,} pixels: "
        f"{large['seconds']:.1f} s, {large['seconds_per_megapixel']:.3g} s per megapixel "
        f"({large['ratio']:.2f} x the small picture's), peak memory {large['peak_memory_gb']:.2f} GB.",
        "## Targets",
        _targets_table(result),
    ]
    return "\n\n".join(parts) + "\n"


def _training_table(result: Mapping[str, Any]) -> str:
    ratios = ["ratio", "of the paper's", "float32 / this"]
    columns = ["step", "seconds", *ratios, "images/s", *PHASES, "outside", "peak GB"]
    rows = [
        {
            "step": row["name"],
            "seconds": f"{row['seconds']:.3g}",
            "ratio": f"{row['ratio']:.2f}",
            "of the paper's": f"{row['of_paper_step']:.2f}",
            "float32 / this": "-" if row["speedup_over_float32"] is None else f"{row['speedup_over_float32']:.2f}",
            "images/s": f"{row['images_per_second']:.3g}",
            **{phase: f"{row['phases'][phase]['share']:.1%}" for phase in PHASES},
            "outside": f"{row['outside_share']:.1%}",
            "peak GB": "-" if row["peak_memory_gb"] is None else f"{row['peak_memory_gb']:.2f}",
        }
        for row in result["training"]
    ]
    return markdown_table(columns, rows)


def _inference_table(result: Mapping[str, Any]) -> str:
    columns = ["network", "s per megapixel", "ratio", "eager float32 / this"]
    rows = [
        {
            "network": row["name"],
            "s per megapixel": f"{row['seconds_per_megapixel']:.3g}",
            "ratio": f"{row['ratio']:.2f}",
            "eager float32 / this": f"{row['speedup_over_float32']:.2f}",
        }
        for row in result["inference"]
    ]
    return markdown_table(columns, rows)


def _targets_table(result: Mapping[str, Any]) -> str:
    rows = [
        {
            "target": name.replace("_", " "),
            "limit": f"{target['limit']:g}",
            "measured": f"{target['measured']:.3g}",
            "met": "yes" if target["met"] else "no",
        }
        for name, target in result["targets"].items()
    ]
    return markdown_table(["target", "limit", "measured", "met"], rows)


def _wh(size: list[int]) -> str:
    return f"{size[1]} x {size[0]}"
