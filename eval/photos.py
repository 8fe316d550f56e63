"""python -m eval.photos: enhance every photograph of a folder."""

import sys

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import command, is_bf16, pick_device
from diffnav.checkpoints import load_enhancer
from diffnav.errors import UserError
from diffnav.evaluation.photos import enhance_photos, plan_photos
from diffnav.training.allocator import keep_freed_memory


@command("photos")
def main(cfg: DictConfig) -> None:
    bf16 = is_bf16(cfg.precision)
    if not 1 <= cfg.quality <= 100:
        raise UserError(f"quality must be 1 to 100, got {cfg.quality}")
    device = pick_device(cfg.device)
    jobs = plan_photos(str(cfg.images), str(cfg.out), cfg.overwrite)
    keep_freed_memory()
    enhancer = instantiate(cfg.enhancer) if "enhancer" in cfg else load_enhancer(cfg.checkpoint, device)
    outcome = enhance_photos(jobs, enhancer, device, bf16, cfg.quality)
    for problem in outcome.skipped:
        print(f"skipped: {problem}", file=sys.stderr)
    if not outcome.written:
        raise UserError(f"none of the {len(jobs)} images could be enhanced; give others as images=")
    print(f"{cfg.out}: {len(outcome.written)} of {len(jobs)} photographs enhanced")


if __name__ == "__main__":
    main()
