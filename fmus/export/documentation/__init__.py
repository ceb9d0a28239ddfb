"""What is documented of a component: its docstring and its variables as data, and both as a page."""

from fmus.export.documentation.html import css, html_body, html_document
from fmus.export.documentation.page import ComponentPage, page_of

__all__ = ["ComponentPage", "css", "html_body", "html_document", "page_of"]
