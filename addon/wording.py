"""How messages to the user say things."""


def named(names):
    """'A', or 'A' and how many more."""
    names = list(dict.fromkeys(names))
    return f"'{names[0]}'" + (f" (and {len(names) - 1} more)" if len(names) > 1 else "")
