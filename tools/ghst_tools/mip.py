"""`package.json`, from which `mip` installs lib/ghst on a board: `ghst mip-manifest`."""

import json
import tomllib
from pathlib import Path

import click

from ghst_tools import boards, device_files
from ghst_tools.errors import GhstError
from ghst_tools.files import explained, write_file

MANIFEST = "package.json"


def manifest(root: Path | None = None) -> str:
    """The text of package.json for the modules of lib/ghst that are for boards.

    Addresses are relative to it, so that it works from a folder as well as from a repository.
    `GhstError` if `root` is no checkout.
    """
    root = root or boards.checkout()
    project = root / "pyproject.toml"
    try:
        with explained(project), project.open("rb") as file:
            version = tomllib.load(file)["project"]["version"]
    except (tomllib.TOMLDecodeError, KeyError) as error:
        raise GhstError(f"{project}: has no version of a project: {error}") from error
    urls = [
        [module.relative_to("lib").as_posix(), module.as_posix()]
        for module in device_files.library_modules(root)
    ]
    return json.dumps({"urls": urls, "deps": [], "version": version}, indent=4) + "\n"


@click.command()
@click.option(
    "--tree", type=click.Path(path_type=Path, file_okay=False), help="Checkout to describe."
)
def command(tree: Path | None) -> None:
    """Write package.json for lib/ghst; to be run when a module comes or goes."""
    path = (tree or boards.checkout()) / MANIFEST
    content = manifest(tree).encode()
    with explained(path):
        write_file(path, content)
    click.echo(path)
