"""Executes the notebooks of docs/python from empty to end; ``--keep`` keeps their outputs there."""

import argparse
import os
import re
import sys
import tempfile
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parents[1] / "docs/python"
EXAMPLES = FOLDER.parents[1] / "python/examples"
MOST_BYTES = 600_000
"""Largest notebook with its outputs."""


def executed(file: Path, folder: str) -> nbformat.NotebookNode:
    """The notebook with the outputs of an execution in a folder of its own."""
    notebook = nbformat.read(file, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": folder}}).execute()
    return cleaned(notebook, folder)


def cleaned(notebook: nbformat.NotebookNode, folder: str) -> nbformat.NotebookNode:
    """The notebook without times of its execution, and without the folder."""
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", []):
            if "text" in output:
                output.text = output.text.replace(folder, ".")
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
    return notebook


def check(file: Path, keep: bool) -> None:
    """Executes a notebook; an error in a cell is raised."""
    start = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        notebook = executed(file, folder)
    text = nbformat.writes(notebook) + "\n"
    if len(text) > MOST_BYTES:
        raise SystemExit(f"{file.name} has {len(text)} bytes, more than {MOST_BYTES}")
    if re.search(r"/(root|home|work|tmp)/", text):
        raise SystemExit(f"{file.name} shows a path of this machine")
    if keep:
        file.write_text(text, encoding="utf-8")
    print(f"{file.name}: {time.perf_counter() - start:.1f} s, {len(text)} bytes")


def main() -> None:
    """Checks all notebooks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--keep", action="store_true", help="keep the outputs")
    arguments = parser.parse_args()
    # Figures are shown in the notebook.
    os.environ.pop("MPLBACKEND", None)
    os.environ["PYTHONPATH"] = str(EXAMPLES)
    files = sorted(FOLDER.glob("*.ipynb"))
    if not files:
        sys.exit(f"there is no notebook in {FOLDER}")
    for file in files:
        check(file, arguments.keep)


if __name__ == "__main__":
    main()
