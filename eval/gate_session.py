"""What eval.navigation makes of its settings for gates: the one to use, or a calibration of both."""

from collections.abc import Sequence
from pathlib import Path
from typing import get_args

from hydra.utils import instantiate
from omegaconf import DictConfig

from diffnav.data.photos import folder_photos
from diffnav.errors import UserError
from diffnav.evaluation.methods import Method
from diffnav.navigation.gates.calibration import (
    Calibration,
    GateName,
    fit_gates,
    read_gates,
    shipped_gates,
    write_gates,
)
from diffnav.navigation.gates.gate import Always, Gate, Never
from diffnav.navigation.gates.samples import gate_samples
from eval.contest_session import make_matchers


def make_gate(cfg: DictConfig, methods: Sequence[Method], out: Path) -> Gate:
    """The gate that `gate` names, its threshold fitted anew with `calibrate`, of the file `gates`, or shipped."""
    if cfg.gate not in get_args(GateName):
        raise UserError(f"gate must be one of {', '.join(get_args(GateName))}, got {cfg.gate}")
    if cfg.calibrate is not None:
        return calibrated(cfg, methods, out).gate(cfg.gate)
    if cfg.gate in ("never", "always"):
        return Never() if cfg.gate == "never" else Always()
    return (read_gates(cfg.gates) if cfg.gates else shipped_gates()).gate(cfg.gate)


def calibrates_only(cfg: DictConfig) -> bool:
    """Whether the gates shall be fitted, and no map is given to search."""
    return cfg.calibrate is not None and "path" in cfg.maps and cfg.maps.path is None


def calibrated(cfg: DictConfig, methods: Sequence[Method], out: Path) -> Calibration:
    """Both gates fitted on the photos of `calibrate`, and kept in out/gates.json."""
    networks = [method for method in methods if method.parameters]
    if not networks:
        raise UserError("calibrate needs an enhancer that the benefit gate decides about: give checkpoint=")
    matchers = make_matchers(cfg.matchers)
    samples, problems = gate_samples(
        folder_photos(cfg.calibrate),
        networks[-1].enhancer,
        [named.matcher for named in matchers],
        cfg.seed,
        instantiate(cfg.darkness),
        device=networks[-1].device,
    )
    facts = {
        "pictures": len(samples),
        "left_out": problems,
        "enhancer": networks[-1].name,
        "enhancer_sha256": networks[-1].sha256,
        "matchers": {named.name: dict(named.matcher.settings) for named in matchers},
        "seed": cfg.seed,
    }
    calibration = fit_gates(samples, facts)
    write_gates(out / "gates.json", calibration)
    return calibration


def calibration_line(calibration: Calibration, out: Path) -> str:
    """Both thresholds and how they err, in a sentence."""
    definition, benefit = calibration.definition, calibration.benefit
    return (
        f"{out}/gates.json: the definition gate, {definition.threshold:.2f}, passes {definition.dark_passed:.1%} of "
        f"the dark pictures and enhances {definition.normal_enhanced:.1%} of those by day; the benefit gate, "
        f"{benefit.threshold:.1f}, misses {benefit.missed:.1%} of the pictures that enhancing helps and enhances "
        f"{benefit.harmed:.1%} of the others"
    )
