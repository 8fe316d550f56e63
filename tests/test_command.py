"""What every command does with its arguments: a user's mistake is one sentence on standard error and exit code 2."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from omegaconf import DictConfig, OmegaConf

from conf.checks import refuse_misfits
from conf.command import CONF, choice, choices, command, pick_device, plain
from diffnav.errors import UserError

Run = Callable[..., Any]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run a command that is configured like eval.enhancement and does nothing; its resolved configuration."""

    def arguments(*given: str, body: Callable[[DictConfig], None] | None = None) -> dict:
        seen: list[dict] = []

        def main(cfg: DictConfig) -> None:
            if body:
                body(cfg)
            seen.append(plain(cfg))

        monkeypatch.setattr(sys, "argv", ["command", *given])
        command("enhancement")(main)()
        return seen[0]

    return arguments


def sentence(run: Run, capsys: pytest.CaptureFixture[str], *given: str, **options: Any) -> str:
    with pytest.raises(SystemExit) as left:
        run(*given, **options)
    assert left.value.code == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("error: ")
    assert printed.err.count("\n") == 1
    assert "HYDRA" not in printed.err
    return printed.err


@pytest.mark.parametrize(
    ("given", "parts"),
    [
        (["lmit=3"], ["no setting lmit", "did you mean limit?"]),
        (["darkness.gama=[3,5]"], ["no setting darkness.gama", "did you mean darkness.gamma?"]),
        (["+brightness=3"], ["no setting brightness"]),
        (["figures=null"], ["no setting figures", "figures.count"]),
        (["data=moon"], ["unknown data=moon", "aerial", "folder", "scenes"]),
        (["darkness=pitch"], ["unknown darkness=pitch", "paper", "varied"]),
        (["data=folder"], ["data.root is missing", "data.root=..."]),
        (["seed=abc"], ["seed cannot be 'abc'"]),
        (["seed=1.5"], ["seed cannot be 1.5"]),
        (["figures.count=true"], ["figures.count cannot be True"]),
        (["darkness.gamma=[a,b]"], ["darkness.gamma cannot be 'a'"]),
        (["out=/a,b"], ["write key=[a,b] for a list", "quote"]),
        (["out=/a b=c"], ["quote a value with spaces, commas or = twice"]),
        (["checkpoint=[a"], ["quote a value"]),
        (["out"], ["out"]),
    ],
)
def test_mistakes_name_the_setting_and_the_way_out(
    given: list[str], parts: list[str], run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    said = sentence(run, capsys, *given)
    for part in parts:
        assert part in said


@pytest.mark.parametrize(
    ("given", "value"),
    [
        ('out="/my photos/a, b"', "/my photos/a, b"),
        ('out="/gamma=4/x"', "/gamma=4/x"),
        ("out='/it is/x=1, y'", "/it is/x=1, y"),
        ("out=/plain/path-1_2.jpg", "/plain/path-1_2.jpg"),
        ("out=/my photos/a", "/my photos/a"),
        ('out="/grüße/写真"', "/grüße/写真"),
    ],
)
def test_paths_with_spaces_commas_and_equals_signs(given: str, value: str, run: Run) -> None:
    assert run(given)["out"] == value


def test_values_that_fit_pass(run: Run) -> None:
    cfg = run("darkness.cast=0", "limit=5", "data.size=[10,20]", "checkpoint=a", "darkness=varied", "cache=null")
    assert (cfg["darkness"]["cast"], cfg["limit"], cfg["checkpoint"]) == (0, 5, "a")
    assert cfg["darkness"]["gamma"] == [2.0, 5.5]


def test_a_users_mistake_inside_a_command_is_its_sentence(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    def body(cfg: DictConfig) -> None:  # noqa: ARG001
        try:
            raise UserError("no folder /x: give one")
        except UserError as error:
            raise RuntimeError("wrapped") from error

    assert sentence(run, capsys, body=body) == "error: no folder /x: give one\n"


def test_a_programming_error_keeps_its_traceback(run: Run) -> None:
    def body(cfg: DictConfig) -> None:  # noqa: ARG001
        raise KeyError("bug")

    with pytest.raises(KeyError, match="bug"):
        run(body=body)


def test_interruption_is_one_word(run: Run) -> None:
    def body(cfg: DictConfig) -> None:  # noqa: ARG001
        raise KeyboardInterrupt

    with pytest.raises(SystemExit) as left:
        run(body=body)
    assert left.value.code == "interrupted"


def test_nothing_is_written_beside_the_results(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run()
    assert list(tmp_path.iterdir()) == []


def test_a_real_process_prints_no_traceback(tmp_path: Path) -> None:
    where = {"cwd": CONF.parent, "env": {**os.environ, "OMP_NUM_THREADS": "1"}}
    given = ["device=cpu", f"data.root={tmp_path / 'none'}", f"out={tmp_path / 'out'}"]
    left = subprocess.run([sys.executable, "-m", "eval.enhancement", *given], capture_output=True, text=True, **where)
    assert left.returncode == 2
    assert left.stdout == ""
    assert left.stderr == f"error: no folder {tmp_path / 'none'}: give an existing folder of images\n"


def test_choice_lists_what_exists_and_refuses_what_does_not() -> None:
    assert {"input", "normal", "gamma_blind", "gamma_oracle", "clahe"} <= set(choices("enhancer"))
    assert choice("enhancer", "clahe", OmegaConf.create({"grid": 4})).grid == 4
    with pytest.raises(UserError, match=r"unknown enhancer 'x'; there are .*clahe"):
        choice("enhancer", "x")
    with pytest.raises(UserError, match="enhancer clahe has no setting clip; its settings: clip_limit, grid, channel"):
        choice("enhancer", "clahe", OmegaConf.create({"clip": 4}))
    with pytest.raises(UserError, match="no setting _target_"):
        choice("enhancer", "clahe", OmegaConf.create({"_target_": "os.system"}))


def test_devices() -> None:
    assert pick_device("cpu").type == "cpu"
    assert pick_device("auto").type in ("cpu", "cuda")
    with pytest.raises(UserError, match="auto, cpu or cuda"):
        pick_device("tpu")


@pytest.mark.parametrize(
    ("default", "value", "fits"),
    [
        (1, 2, True),
        (1, 2.0, False),
        (1, True, False),
        (1, "2", False),
        (1, None, True),
        (1.0, 2, True),
        (1.0, "x", False),
        (True, False, True),
        (True, 1, False),
        (None, "anything", True),
        ("text", 3, True),
        ([1.0, 2.0], [3, 4.5], True),
        ([1.0, 2.0], [3, "x"], False),
        ([], ["x"], True),
    ],
)
def test_kinds_of_values(default: object, value: object, fits: bool) -> None:
    cfg, defaults = (OmegaConf.create({"group": {"key": one}}) for one in (value, default))
    if fits:
        refuse_misfits(cfg, defaults)
    else:
        with pytest.raises(UserError, match=r"group\.key cannot be"):
            refuse_misfits(cfg, defaults)
