"""What can be wrong with a component's text."""

from difflib import get_close_matches


class ComponentError(Exception):
    """A component's definition contradicts itself; fields: component, text."""

    def __init__(self, component: str, text: str):
        self.component, self.text = component, text
        super().__init__(f"{component}: {text}")


def hint(name: str, known: list[str]) -> str:
    """Return " Did you mean 'x'?" for known names that look like a name, "" where none does."""
    near = get_close_matches(name, known, n=3, cutoff=0.6)
    return f" Did you mean {' or '.join(map(repr, near))}?" if near else ""
