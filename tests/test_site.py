"""The documentation as a site: it builds without a warning, links lead somewhere, the search knows every variable."""

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from urllib.parse import unquote, urljoin, urlsplit

import pytest
from lxml import html

from components.catalog import MODULES

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    place = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(place)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "WARNING -" not in done.stderr
    return place


@pytest.fixture(scope="module")
def pages(site):
    """Address below the site -> page."""
    found = sorted(site.rglob("*.html"))
    return {path.relative_to(site).as_posix().removesuffix("index.html"): html.parse(path) for path in found}


@pytest.fixture(scope="module")
def entries(site):
    """What the search finds: address -> text."""
    found = json.loads((site / "search" / "search_index.json").read_text(encoding="utf-8"))["docs"]
    return {entry["location"]: f"{entry['title']} {entry['text']}" for entry in found}


def test_every_link_leads_to_a_page_and_a_place_on_it(site, pages):
    anchors = {address: set(page.xpath("//@id")) for address, page in pages.items()}
    lost = []
    for address, page in pages.items():
        if address == "404.html":  # its links are from the site's root
            continue
        for link in page.xpath("//a/@href | //img/@src | //link/@href | //script/@src"):
            to = urlsplit(urljoin(f"site:/{address}", link)) if not urlsplit(link).scheme else urlsplit(link)
            path = unquote(to.path).lstrip("/")
            if to.scheme == "site" and not ((site / path).is_file() or path in pages):
                lost.append((address, link))
            elif to.scheme == "site" and to.fragment and path in anchors and to.fragment not in anchors[path]:
                lost.append((address, link))
    assert lost == []


def test_nothing_is_loaded_from_elsewhere(pages):
    loaded = {link for page in pages.values() for link in page.xpath("//img/@src | //link/@href | //script/@src")}
    assert [link for link in loaded if urlsplit(link).netloc] == []


def variables(name):
    c = getattr(import_module(MODULES[name]), name)()
    return (*c.parameters, *c.calculated_parameters, *c.inputs, *c.states, *c.outputs_declared)


@pytest.mark.parametrize("name", MODULES)
def test_a_component_has_its_page(name, pages):
    page = pages[f"components/{name}/"]
    rows = [[cell.text_content() for cell in row.iter("td")] for row in page.iter("tr")]
    units = {row[0].partition("[")[0]: (row[1], row[-1]) for row in rows if row}
    for variable in variables(name):
        unit, meaning = units[variable.name]
        assert unit == variable.unit and len(meaning) > 3
    assert {"Source", "Limits"} <= {title.text for title in page.iter("h2")}


@pytest.mark.parametrize("name", MODULES)
def test_a_search_for_a_variable_finds_it(name, entries):
    for variable in variables(name):
        assert any(where.startswith(f"components/{name}/") and variable.name in said for where, said in entries.items())
