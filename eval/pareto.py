"""python -m eval.pareto: PSNR against correct matches, the Pareto front of two evaluations of the same methods."""

from pathlib import Path

from omegaconf import DictConfig

from conf.command import command
from diffnav.evaluation.pareto import pareto_page, pareto_rows, read_rows, write_pareto_plot
from diffnav.evaluation.tables import write_json, write_text
from eval.session import plain_list


@command("pareto")
def main(cfg: DictConfig) -> None:
    out = Path(str(cfg.out)).expanduser()
    sources = {key: str(cfg[key]) for key in ("enhancement", "matching")}
    enhancement, matching = (read_rows(Path(path).expanduser()) for path in sources.values())
    methods, matchers = plain_list(cfg.methods), plain_list(cfg.matchers)
    enhancement = [row for row in enhancement if not methods or row["method"] in methods]
    matching = [row for row in matching if not matchers or row["matcher"] in matchers]
    rows = pareto_rows(enhancement, matching)
    write_json(out / "pareto.json", {"rows": rows, "protocol": sources})
    write_text(out / "pareto.md", pareto_page(rows, sources))
    write_pareto_plot(out / "pareto.png", rows)
    print(f"{out}: {len(rows)} points, {sum(row['front'] for row in rows)} of them on the front")


if __name__ == "__main__":
    main()
