"""python -m eval.benchmark: training steps, inference and one large picture, timed side by side."""

from pathlib import Path

from hydra.utils import instantiate
from omegaconf import DictConfig

from conf.command import choice, command, pick_device, plain
from diffnav.evaluation.benchmark import run_benchmark
from diffnav.evaluation.benchmark_page import benchmark_page
from diffnav.evaluation.tables import write_json, write_text
from diffnav.evaluation.training_speed import TrainingSetup, scenery_store
from diffnav.training.allocator import keep_freed_memory
from train.session import compile_stage


@command("benchmark")
def main(cfg: DictConfig) -> None:
    out = Path(cfg.out).expanduser()
    device = pick_device(cfg.device)
    keep_freed_memory()
    sizes = instantiate(cfg.sizes, _convert_="all")
    setup = TrainingSetup(
        scenery_store(cfg.pictures, tuple(cfg.picture_size)),
        instantiate(cfg.darkness),
        instantiate(cfg.loss),
        instantiate(cfg.decom_loss),
        instantiate(cfg.optimiser, _convert_="all"),
        cfg.batch,
        cfg.patch,
        recipes={name: instantiate(loss) for name, loss in cfg.recipes.items()},
        descriptors={name: instantiate(choice("descriptor", name)) for name in cfg.descriptors},
    )
    compiler = compile_stage if cfg.compile else None
    result = run_benchmark(plain(cfg)["networks"], setup, sizes, device, compiler, list(cfg.backends))
    page = benchmark_page(result)
    write_json(out / "benchmark.json", result)
    write_text(out / "benchmark.md", page)
    print(f"{page}\n{out}: benchmark.json and benchmark.md")


if __name__ == "__main__":
    main()
