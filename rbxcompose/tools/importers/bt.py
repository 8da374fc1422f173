"""`bt`: trees of BehaviorTree.CPP, version 4."""

from collections.abc import Sequence

from rbxcompose.base.findings import Report
from rbxcompose.commands.importing.foreign_files import ForeignFile
from rbxcompose.commands.importing.importer import ImportedFiles, importer
from rbxcompose.tools.behaviour_trees.forest import read_forest
from rbxcompose.tools.behaviour_trees.forest_importer import ForestImporter


@importer("bt", "trees of BehaviorTree.CPP as missions")
def bt(files: Sequence[ForeignFile], name: str, report: Report) -> ImportedFiles:
    """Return a mission for the main tree, and beside it one for each other tree."""
    forest = read_forest(files, report)
    return ForestImporter(forest, name, report).imported() if forest.trees else ImportedFiles("")
