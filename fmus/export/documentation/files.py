"""What an FMU carries for people: documentation/index.html and model.png."""

from components.framework import Component
from fmus.description.description import ModelDescription
from fmus.export.documentation.html import html_document
from fmus.export.documentation.icon import icon
from fmus.export.documentation.page import page_of


def documents(component: Component, description: ModelDescription) -> dict[str, bytes]:
    """Return these files by their names in the FMU; the same component gives the same bytes."""
    page = page_of(component)
    version = f" {description.version}" if description.version else ""
    made = f"{description.model_name}: FMI 2.0 for co-simulation, by {description.generation_tool}{version}"
    inputs, outputs = ([v.sized for v in page.of_kind(kind)] for kind in ("input", "output"))
    return {
        "documentation/index.html": html_document(page, made).encode(),
        "model.png": icon(page.name, inputs, outputs),
    }
