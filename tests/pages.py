"""Pages with parts of a test's own, for tests."""

from __future__ import annotations

from matter.wording import page

_BODY = """{% extends "matter/wording/templates/page.html.j2" %}
{% block body %}{% for part in parts %}{{ part|safe }}{% endfor %}{% endblock %}"""


def document(title: str, parts: list[str]) -> str:
    """A page under a ``title`` and headline, with ``parts`` (HTML)."""
    return page._environment().from_string(_BODY).render(headline=title, title=title, parts=parts)


def table(head: list[str], rows: list[list[str]], **columns: tuple[int, ...]) -> str:
    """A table as pages have it."""
    return page.render(page.PARTS, "table", head=head, rows=rows, **columns)
