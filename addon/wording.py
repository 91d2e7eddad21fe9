"""How messages name things."""


def named(names):
    """'A', or 'A' and how many more; each name counts once."""
    names = list(dict.fromkeys(names))
    return f"'{names[0]}'" + (f" (and {len(names) - 1} more)" if len(names) > 1 else "")
