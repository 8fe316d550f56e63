"""python -m eval.export checkpoint=compact_joint out=compact_joint.onnx: an enhancer as ONNX, for any picture size."""

from pathlib import Path

from omegaconf import DictConfig

from conf.command import command
from diffnav.evaluation.provenance import git_commit
from diffnav.export import export_checkpoint


@command("export")
def main(cfg: DictConfig) -> None:
    out = Path(str(cfg.out)).expanduser()
    metadata = export_checkpoint(str(cfg.checkpoint), out, git_commit())
    size_mb = out.stat().st_size / 1e6
    print(f"{out}: {metadata['checkpoint']} as ONNX, {size_mb:.2f} MB; sha256 of its weights {metadata['sha256']}")


if __name__ == "__main__":
    main()
