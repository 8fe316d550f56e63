"""The README is true: its tables are those of results/, its example runs, its commands have these settings."""

import re
import shlex
from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
COMMANDS = sorted(
    line.split("  #")[0].strip()
    for block in re.findall(r"```sh\n(.*?)```", README, re.S)
    for line in block.splitlines()
    if line.startswith("python -m")
)


def table_in(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.startswith("|")]


def test_each_table_is_the_one_that_was_measured():
    tables = re.findall(r"<!-- table: (\S+) -->\n(.*?)<!-- end of table -->", README, re.S)
    assert tables
    for path, text in tables:
        measured = (ROOT / path).read_text().split("\n## ")[0]
        assert table_in(text) == table_in(measured), path


def test_every_link_leads_to_a_file():
    for target in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / target).exists(), target


def test_the_python_example_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    example = re.search(r"```python\n(.*?)```", README, re.S).group(1)
    exec(compile(example, "README.md", "exec"), {})
    assert (tmp_path / "bright.png").stat().st_size > 0


@pytest.mark.parametrize("line", COMMANDS)
def test_each_command_has_the_settings_that_it_is_given(line):
    _, _, module, *settings = shlex.split(line)
    door = (ROOT / f"{module.replace('.', '/')}.py").read_text()
    config = re.search(r'@command\("(\w+)"\)', door).group(1)
    with initialize_config_dir(str(ROOT / "conf"), version_base="1.3"):
        cfg = compose(config, overrides=settings)
    for setting in settings:
        key = setting.split("=")[0]
        assert key in cfg or "." in key or key == "experiment"
