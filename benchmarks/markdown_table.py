"""Tables in Markdown, line by line."""


def table_head(names, texts=1):
    """The lines before a table's rows; the first `texts` columns are text, the others numbers."""
    return "", table_row(names), table_row("---" if i < texts else "--:" for i in range(len(names)))


def table_row(cells):
    return "| " + " | ".join(map(str, cells)) + " |"
