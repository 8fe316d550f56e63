"""The colour and the line of every method, the same in every plot."""

from collections.abc import Sequence
from typing import Any

# Bounds and plain curves in grey and orange, the field's methods in blue and green, published networks in violet.
KNOWN = {
    "input": ("#000000", "-"),
    "normal": ("#888888", "--"),
    "gamma_blind": ("#ff7f0e", "-"),
    "gamma_oracle": ("#ff7f0e", "--"),
    "clahe": ("#bcbd22", "-"),
    "msrcr": ("#bcbd22", "--"),
    "dong": ("#1f77b4", "-"),
    "lime": ("#1f77b4", "--"),
    "mf": ("#17becf", "-"),
    "npe": ("#17becf", "--"),
    "srie": ("#2ca02c", "-"),
    "lightennet": ("#2ca02c", "--"),
    "zero_dce": ("#9467bd", "-"),
    "published_zero_dce": ("#9467bd", "--"),
    "published_zero_dce_pp": ("#9467bd", ":"),
    "published_sgz": ("#8c564b", "-"),
    "published_sci": ("#8c564b", "--"),
    "published_retinexnet": ("#8c564b", ":"),
}
# Everything else, in the order in which it comes: mostly our networks.
OTHERS = [(colour, line) for line in ("-", "--", ":") for colour in ("#d62728", "#e377c2", "#7a0c1e", "#f4a3a3")]


def method_styles(methods: Sequence[str]) -> dict[str, dict[str, Any]]:
    """Method -> matplotlib's colour, linestyle and marker."""
    others = [method for method in methods if method not in KNOWN]
    styles = KNOWN | {method: OTHERS[index % len(OTHERS)] for index, method in enumerate(others)}
    return {method: {"color": styles[method][0], "linestyle": styles[method][1], "marker": "o"} for method in methods}
