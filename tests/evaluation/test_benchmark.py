import json
import subprocess
import sys
import time
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import torch

from diffnav.darkness import DarknessModel
from diffnav.errors import UserError
from diffnav.evaluation import timing
from diffnav.evaluation.benchmark import Sizes, run_benchmark
from diffnav.evaluation.benchmark_page import benchmark_page
from diffnav.evaluation.inference_speed import InferenceCase, inference_rows, inference_timers
from diffnav.evaluation.memory import in_own_process, peak_memory_gb
from diffnav.evaluation.timing import PHASES, PhaseClock, interleave
from diffnav.evaluation.training_speed import TrainingCase, TrainingSetup, TrainingTimer, scenery_store
from diffnav.losses.hybrid import HybridLoss
from diffnav.losses.retinex import RetinexLoss

CPU = torch.device("cpu")
REPOSITORY = Path(__file__).parents[2]
NETWORKS = {
    "compact": {"width": 4, "padding": "zeros"},
    "paper": {"width": 6, "padding": "replicate"},
}


@pytest.fixture(scope="module")
def setup():
    store = scenery_store(2, (48, 64))
    adam = partial(torch.optim.Adam, lr=1e-4)
    light = {"hybrid_light": HybridLoss(w_s=0.5)}
    return TrainingSetup(store, DarknessModel(), RetinexLoss(), RetinexLoss(), adam, 2, 32, recipes=light)


@pytest.fixture
def clock(monkeypatch):
    """A clock that stands still unless `clock.tick(seconds)` is called."""

    class Clock:
        now = 0.0

        def tick(self, seconds):
            self.now += seconds

    clock = Clock()
    monkeypatch.setattr(timing.time, "perf_counter", lambda: clock.now)
    return clock


def test_every_moment_counts_to_the_phase_named_before_it(clock):
    phases = PhaseClock(CPU)
    phases.start("data")
    clock.tick(1)
    phases.mark("forward")
    clock.tick(2)
    phases.mark("backward")
    clock.tick(4)
    phases.mark("forward")
    clock.tick(8)
    assert phases.stop() == {"data": 1, "forward": 10, "backward": 4, "optimiser": 0, "other": 0}
    phases.start("data")
    assert sum(phases.stop().values()) == 0


def test_timers_take_turns_and_medians_leave_out_the_warm_up():
    turns = []

    class Fake:
        def __init__(self, name, seconds):
            self.name, self.seconds = name, iter(seconds)

        def run(self):
            turns.append(self.name)
            return dict.fromkeys(PHASES, next(self.seconds))

    medians = interleave([Fake("a", [99, 1, 7, 2]), Fake("b", [99, 30, 10, 20])], repeats=3, warmup=1)
    assert turns == ["a", "b"] * 4
    assert medians == {"a": dict.fromkeys(PHASES, 2), "b": dict.fromkeys(PHASES, 20)}


def test_the_phases_of_a_step_are_those_of_the_training_loop(setup, clock):
    """Each part of the step takes a time of its own, by a clock that only these parts move."""

    class SlowAdam(torch.optim.Adam):
        def step(self, closure=None):
            clock.tick(1000)
            return super().step(closure)

    class SlowGradient(torch.autograd.Function):
        @staticmethod
        def forward(ctx, x):  # noqa: ARG004
            clock.tick(10)
            return x.clone()

        @staticmethod
        def backward(ctx, gradient):  # noqa: ARG004
            clock.tick(100)
            return gradient

    class SlowDarkness(DarknessModel):
        def draw(self, maximum, seed):
            clock.tick(1)
            return super().draw(maximum, seed)

    setup = replace(setup, darkness=SlowDarkness(), optimiser=SlowAdam)
    timer = TrainingTimer(TrainingCase("compact", NETWORKS["compact"], "decom"), setup, CPU, steps=1)
    decom = timer._stage.stage.enhancer.decom
    decom.register_forward_hook(lambda *found: tuple(map(SlowGradient.apply, found[2])))
    assert timer.run() == {"data": 2, "forward": 20, "backward": 200, "optimiser": 1000, "other": 0}


def test_steps_train_the_stage_s_own_networks(setup):
    for stage, trains in (("decom", {"decom"}), ("joint", {"decom", "enhance"})):
        timer = TrainingTimer(TrainingCase("compact", NETWORKS["compact"], stage, bf16=True), setup, CPU, steps=1)
        enhancer = timer._stage.stage.enhancer
        before = {name: p.detach().clone() for name, p in enhancer.named_parameters()}
        seconds = timer.run()
        assert min(seconds[phase] for phase in ("data", "forward", "backward", "optimiser")) > 0
        changed = {n.split(".")[0] for n, p in enhancer.named_parameters() if not torch.equal(p, before[n])}
        assert changed == trains


def take(megabytes):
    block = torch.ones(megabytes * 250_000)
    return peak_memory_gb(CPU), block.sum().item()


def test_memory_is_the_process_s_own():
    here = torch.ones(150_000_000)
    little, _ = in_own_process(take, 1)
    much, _ = in_own_process(take, 300)
    assert much - little == pytest.approx(0.3, abs=0.1)
    assert peak_memory_gb(CPU) > little + here.numel() * 4 / 1e9 - 0.3


def die():
    import os

    os._exit(9)


def test_a_process_that_is_ended_is_one_sentence():
    with pytest.raises(UserError, match="process of die was ended by the system"):
        in_own_process(die)


@pytest.fixture(scope="module")
def result(setup):
    sizes = Sizes(repeats=2, warmup=0, inference=(24, 40), large=(64, 96))
    return run_benchmark(NETWORKS, setup, sizes, CPU)


def test_all_cases_are_there(result):
    assert [row["name"] for row in result["training"]] == [
        "compact joint float32",
        "compact joint bf16",
        "compact decom float32",
        "compact decom bf16",
        "paper joint float32",
        "paper joint bf16",
        "compact joint bf16 hybrid_light",
    ]
    assert [row["name"] for row in result["inference"]] == [
        "compact float32",
        "compact bf16",
        "paper float32",
        "paper bf16",
    ]
    assert result["large_image"]["name"] == "compact float32"


def test_figures_agree_with_each_other(result):
    first = result["training"][0]["seconds"]
    for row in result["training"]:
        assert list(row["phases"]) == list(PHASES)
        assert sum(phase["share"] for phase in row["phases"].values()) == pytest.approx(1)
        assert sum(phase["seconds"] for phase in row["phases"].values()) == pytest.approx(row["seconds"])
        inside = sum(row["phases"][phase]["share"] for phase in ("forward", "backward", "optimiser"))
        assert row["outside_share"] == pytest.approx(1 - inside)
        assert row["images_per_second"] == pytest.approx(2 / row["seconds"])
        assert row["ratio"] == pytest.approx(row["seconds"] / first)
        assert 0.1 < row["peak_memory_gb"] < 20
        seconds = {r["name"]: r["seconds"] for r in result["training"]}
        plain = seconds[row["name"].removesuffix(" hybrid_light")]
        assert row["of_paper_step"] == pytest.approx(row["seconds"] / plain)
        if row["recipe"]:
            assert row["speedup_over_float32"] is None
        else:
            exact = seconds[row["name"].replace("bf16", "float32")]
            assert row["speedup_over_float32"] == pytest.approx(exact / row["seconds"])
    for row in result["inference"]:
        assert row["seconds_per_megapixel"] == pytest.approx(row["seconds"] / (24 * 40 / 1e6))
        assert row["ratio"] == pytest.approx(row["seconds"] / result["inference"][0]["seconds"])
    large = result["large_image"]
    assert large["seconds_per_megapixel"] == pytest.approx(large["seconds"] / (64 * 96 / 1e6))
    targets = result["targets"]
    compact = [row for row in result["training"] if row["network"] == "compact"]
    assert targets["outside_share"]["measured"] == max(row["outside_share"] for row in compact)
    assert targets["light_step"] == {
        "limit": 1.6, "measured": compact[-1]["of_paper_step"], "met": compact[-1]["of_paper_step"] <= 1.6
    }  # fmt: skip
    assert targets["large_image_memory_gb"]["measured"] == large["peak_memory_gb"]
    assert all(target["met"] == (target["measured"] <= target["limit"]) for target in targets.values())


def test_the_page_shows_what_the_figures_say(result):
    page = benchmark_page(json.loads(json.dumps(result)))
    assert result["environment"]["versions"]["torch"] in page
    assert f"{torch.get_num_threads()} thread(s)" in page
    for row in result["training"][:-1]:
        line = next(line for line in page.splitlines() if line.startswith(f"| {row['name']} "))
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        assert cells[1:6] == [
            f"{row[key]:{form}}"
            for key, form in (
                ("seconds", ".3g"),
                ("ratio", ".2f"),
                ("of_paper_step", ".2f"),
                ("speedup_over_float32", ".2f"),
                ("images_per_second", ".3g"),
            )
        ]
        assert cells[6] == f"{100 * row['phases']['data']['share']:.1f}%"
    light = result["training"][-1]
    assert f"| {light['name']} |" in page
    assert "96 x 64 in tiles" in page


def test_a_compiled_step_joins_where_a_compiler_is_given(setup):
    compiled = []
    sizes = Sizes(repeats=1, warmup=0, inference=(16, 16), large=(16, 16))
    networks = {"compact": NETWORKS["compact"]}
    setup = replace(setup, recipes={})
    result = run_benchmark(networks, setup, sizes, CPU, lambda stage, device: compiled.append((stage.name, device)))
    assert compiled == [("joint", CPU)]
    row = result["training"][-1]
    assert (row["name"], row["compiled"], row["peak_memory_gb"]) == ("compact joint float32 compiled", True, None)
    assert "| compact joint float32 compiled |" in benchmark_page(result)


def test_backends_join_and_one_that_fails_is_left_out(result, monkeypatch):
    pytest.importorskip("onnxruntime", reason="the extra `export` is not installed")

    def fail(self):
        raise RuntimeError(f"no compiler for {type(self).__name__}\nand a long story")

    monkeypatch.setattr(torch.nn.Module, "compile", fail)
    networks = {"compact": {"width": 2}}
    cases, timers, left_out = inference_timers(networks, ["compile", "onnxruntime"], (33, 20), CPU)
    assert [case.name for case in cases] == ["compact float32", "compact bf16", "compact float32 onnxruntime"]
    assert [timer.name for timer in timers] == [case.name for case in cases]
    assert timers[-1].run()["forward"] > 0
    assert left_out == ["compact float32 compile is left out: no compiler for RetinexEnhancer"]
    page = benchmark_page({**result, "left_out": left_out})
    assert "\n\ncompact float32 compile is left out: no compiler for RetinexEnhancer.\n\n" in page


def test_a_compiled_enhancer_is_compiled_and_has_run_before_it_is_timed(monkeypatch):
    compiled, runs = [], []

    def forward(_, image):
        runs.append(image.shape)
        return image

    monkeypatch.setattr(torch.nn.Module, "compile", lambda self: compiled.append(type(self).__name__))
    monkeypatch.setattr("diffnav.retinex.enhancer.RetinexEnhancer.forward", forward)
    cases, _, left_out = inference_timers({"compact": {"width": 2}}, ["compile"], (16, 24), CPU)
    assert (compiled, runs, left_out) == (["RetinexEnhancer"], [(1, 3, 16, 24)], [])
    assert cases[-1].name == "compact float32 compile"


def test_a_backend_is_compared_with_torch_in_float32():
    eager, other = InferenceCase("compact", {}), InferenceCase("compact", {}, backend="onnxruntime")
    rows = inference_rows([eager, other], {eager.name: {"forward": 6.0}, other.name: {"forward": 2.0}}, (1000, 2000))
    assert [row["backend"] for row in rows] == ["eager", "onnxruntime"]
    assert (rows[1]["seconds_per_megapixel"], rows[1]["speedup_over_float32"]) == (1.0, 3.0)


def test_an_unknown_backend_is_one_sentence():
    with pytest.raises(UserError, match="backends can be compile and onnxruntime, got 'tpu'"):
        inference_timers({"compact": {"width": 2}}, ["tpu"], (16, 16), CPU)


@pytest.mark.parametrize("wrong", [{"repeats": 0}, {"warmup": -1}])
def test_sizes_out_of_range_are_refused(wrong):
    with pytest.raises(UserError, match="repeats must be 1 or more"):
        Sizes(**wrong)


def test_the_command(tmp_path):
    start = time.time()
    small = "batch=1 patch=16 pictures=1 picture_size=[32,32] networks.compact.width=2 networks.paper.width=2"
    sizes = "backends=[] sizes.repeats=1 sizes.warmup=0 sizes.inference=[16,16] sizes.large=[32,48]"
    done = subprocess.run(
        [sys.executable, "-m", "eval.benchmark", f"out={tmp_path}", "device=cpu", *small.split(), *sizes.split()],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        timeout=500,
    )
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "benchmark.json").read_text())
    assert result["settings"] == {"batch": 1, "patch": 16, "repeats": 1, "warmup": 0}
    assert set(result["environment"]) >= {"device", "cpu", "threads", "versions"}
    assert (tmp_path / "benchmark.md").read_text() in done.stdout
    assert (tmp_path / "benchmark.json").stat().st_mtime >= start
