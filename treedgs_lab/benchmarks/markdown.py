"""Blocks as Markdown, for the docs: headings, sentences and tables; pictures and fragments are left out."""

from __future__ import annotations

from collections.abc import Iterable

from treedgs_geo.report.blocks import Block, Cards, Heading, Paragraph, Sentences, Table


def markdown(blocks: Iterable[Block]) -> str:
    """The text, parts apart by an empty line."""
    return "\n\n".join(filter(None, map(_part, blocks))) + "\n"


def _part(block: Block) -> str:
    if isinstance(block, Heading):
        return f"{'#' * block.level} {block.text}"
    if isinstance(block, Paragraph):
        return f"**{block.text}**" if block.strong else block.text
    if isinstance(block, Cards):
        return "\n".join(f"- {label}: {value}{f' ({more})' if more else ''}" for label, value, more in block.items)
    if isinstance(block, Sentences):
        return "\n".join(
            [*([block.title, ""] if block.title and block.items else []), *(f"- {s}" for s in block.items)]
        )
    return _table(block) if isinstance(block, Table) else ""


def _table(table: Table) -> str:
    columns = table.shown
    lines = [[column.heading for column in columns], ["---"] * len(columns)]
    lines += [[table.text(row, column) for column in columns] for row in table.rows]
    text = "\n".join(f"| {' | '.join(_cell(cell) for cell in line)} |" for line in lines)
    return "\n\n".join(filter(None, (table.title, text.replace("| --- ", "|---").replace("--- |", "---|"), table.note)))


def _cell(text: str) -> str:
    """One line of a table's cell; a bar would end it."""
    return " ".join(text.split()).replace("|", "\\|")
