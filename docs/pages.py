"""Every page of the reference, written from the tree: README, docstrings of modules, commands, configuration."""

import ast
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
# Modules that lie at the top of the package, by the page on which they are; the others have their folder's.
TOP = {
    "diffnav": ["diffnav", "checkpoints", "export", "images", "darkness", "scores", "pretrained", "errors"],
    "matching": ["blur"],
    "data": ["decoding"],
}
FOLDERS = {
    "losses": "Pure functions: tensors in, one value out; they know nothing of networks or files.",
    "retinex": "Decom-Net, Enhance-Net, and the enhancer made of the two.",
    "enhancers": "The others that an enhancer is compared with: one a file, all with one call.",
    "matching": "Features, then matches: one matcher a file; `soft` holds what gradients pass through.",
    "geometry": "Homographies, geodesy, and pictures whose place on earth is known.",
    "data": "Folders, splits, pairs with exact homographies, maps, queries, and the embedded world.",
    "training": "One loop, exact run state, stages.",
    "navigation": "Gate, reference map, shortlist, localiser, track, exports.",
    "driving": "Which reference picture of a street a query shows: answers, rows, the shortlist.",
    "evaluation": "Scores, bootstrap, records, tables, figures.",
}
_LINK = re.compile(r"(!?)\[((?:[^\]\[]|\n)*)\]\(([^)#:]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """mkdocs' hook: the pages, as if they lay in docs/."""
    pages = {
        "index.md": index_page(),
        "commands.md": commands_page(),
        "configuration.md": configuration_page(),
        **{f"api/{name}.md": api_page(name) for name in ["diffnav", *FOLDERS]},
    }
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    for picture in readme_pictures():
        files.append(File.generated(config, picture, abs_src_path=str(ROOT / picture)))
    return files


def modules(page: str) -> list[str]:
    """The dotted names of a page's modules, empty ones left out: those at the top first, then its folder's."""
    names = ["diffnav" if name == "diffnav" else f"diffnav.{name}" for name in TOP.get(page, [])]
    paths = sorted((ROOT / "diffnav" / page).rglob("*.py")) if page in FOLDERS else []
    dotted = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in paths if path.read_text().strip()]
    return names + [name.removesuffix(".__init__") for name in dotted]


def api_page(page: str) -> str:
    """A page of the API reference: what its modules' docstrings say."""
    title = f"diffnav.{page}" if page in FOLDERS else "diffnav"
    head = f"# {title}\n\n{FOLDERS.get(page, 'What lies at the top of the package.')}\n"
    return head + "".join(f"\n::: {name}\n" for name in modules(page))


def commands_page() -> str:
    """The commands: what each is for, and its settings with their defaults, as its configuration has them."""
    parts = ["# Commands\n\nA setting is changed by `key=value`; `--cfg job` prints all of them, resolved.\n"]
    for path in sorted([*ROOT.glob("train/*.py"), *ROOT.glob("eval/*.py")]):
        source = path.read_text()
        configured = re.search(r'@command\("(\w+)"\)', source)
        if configured:
            module = f"{path.parent.name}.{path.stem}"
            says = (ast.get_docstring(ast.parse(source)) or "").partition(": ")[2]
            parts.append(f"## python -m {module}\n\n{says}\n\n{_yaml(ROOT / 'conf' / f'{configured.group(1)}.yaml')}")
    return "\n".join(parts)


def configuration_page() -> str:
    """The groups of choices: every YAML of conf/, one heading a group."""
    parts = ["# Configuration\n\n`group=name` takes a choice, `group.setting=value` changes it.\n"]
    for folder in sorted(path for path in (ROOT / "conf").iterdir() if list(path.glob("*.yaml"))):
        parts.append(f"## {folder.name}\n")
        parts += [f"### {folder.name}={path.stem}\n\n{_yaml(path)}" for path in sorted(folder.glob("*.yaml"))]
    return "\n".join(parts)


def index_page() -> str:
    """The README; its pictures come along, what it links to beside them stays a name in the clone."""

    def replace(found: re.Match[str]) -> str:
        picture, text, target = found.groups()
        return found.group() if picture else text if target in text else f"{text} (`{target}`)"

    return _LINK.sub(replace, (ROOT / "README.md").read_text())


def readme_pictures() -> list[str]:
    """The pictures that the README shows, relative to the root, each once."""
    found: list[Any] = _LINK.findall((ROOT / "README.md").read_text())
    return sorted({target for picture, _, target in found if picture})


def _yaml(path: Path) -> str:
    return f"```yaml\n{path.read_text().strip()}\n```\n"
