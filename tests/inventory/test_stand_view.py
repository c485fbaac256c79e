"""The stand in 3D: what the page holds, and that a browser shows it from the file and answers a click."""

from __future__ import annotations

import base64
import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import numpy as np
import pytest
import rasterio
from rasterio.transform import from_origin

from treedgs_geo.core.errors import OutputError
from treedgs_geo.core.plots import Plot
from treedgs_geo.inventory.side_layers import along
from treedgs_geo.inventory.stand_view import Dots, Stand, view_of, write_view
from treedgs_geo.inventory.tree_layer import tree_table
from treedgs_geo.stems.quality.tree import Tree

HOSTILE = "<script>document.title='broken'</script>\"'&{{ 7 * 7 }}"
X, Y = 611300.0, 3718400.0


def some_trees() -> list[Tree]:
    measured = {"dbh_se_cm": 0.4, "z_ground": 38.0, "method": "photos"}
    return [
        Tree(3, X + 2, Y + 3, dbh_cm=31.24, height_m=20.0, height_se_m=0.6, **measured).finish(),
        Tree(12, X + 8, Y + 6, dbh_cm=18.0, qc_flag="check", qc_reason="few_views", **measured).finish(),
        Tree(40, X + 5, Y + 9, qc_flag="reject", qc_reason="few_views", method="photos").finish(),
    ]


def page_of(folder: Path, **more) -> Path:
    """Sloping ground, a plot, a sheet in a folder whose name needs quoting."""
    sheet = folder / "the sheets" / "3.jpg"
    sheet.parent.mkdir()
    sheet.write_bytes(b"")
    trees, plots = tree_table(some_trees(), "EPSG:6344"), [Plot(HOSTILE, X + 5, Y + 5, 6.0)]
    stand = Stand(trees, plots, lambda x, y: 38 + 0.1 * (x - X) + 0 * y, sheets={3: sheet}, **more)
    return write_view(view_of(folder / "report.html"), stand)


def data_of(page: Path) -> dict:
    text = page.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)[1])


def test_stems_stand_where_and_as_thick_as_they_were_measured(tmp_path):
    heights = np.array([0.5, 1.5, 2.5])
    curve = np.column_stack([X + 2 + 0.1 * heights, Y + 3 + 0 * heights, heights, 33 - 1.2 * heights])
    stems = {stem["id"]: stem for stem in data_of(page_of(tmp_path, curves={3: curve}))["stems"]}
    path = np.array(stems[3]["path"])
    assert path[[0, -1], 2].tolist() == [38.0, 58.0], "from the ground up to the height"
    np.testing.assert_allclose(path[-1, :2], [X + 4, Y + 3], atol=0.002, err_msg="straight on along the lean")
    np.testing.assert_allclose(200 * path[1:-1, 3], curve[:, 3], atol=0.2)
    assert stems[3]["lines"][0] == "DBH 31.2 ± 0.4 cm" and "height 20.0 ± 0.6 m" in stems[3]["lines"]
    assert stems[3]["sheet"] == "the%20sheets/3.jpg" and stems[12]["sheet"] == ""
    assert np.ptp(np.array(stems[12]["path"])[:, 2]) == pytest.approx(5.0), "as far as photos see, without a height"
    assert not stems[40]["known"] and stems[40]["path"][0][2] == pytest.approx(38.5), "the ground there"
    np.testing.assert_allclose(along(curve, 10.0), [X + 3, Y + 3])


def test_points_and_gaussians_are_thinned_and_cut_to_the_box(tmp_path):
    rng = np.random.default_rng(1)
    xyz = rng.uniform([X - 50, Y - 50, 38], [X + 60, Y + 60, 60], (4_000_000, 3))
    colours = rng.integers(0, 255, xyz.shape).astype(np.uint8)
    size, opacity = np.full(len(xyz), 0.05), rng.uniform(0, 1, len(xyz))
    page = page_of(tmp_path, points=Dots(xyz), gaussians=Dots(xyz, colours, size, opacity))
    data = data_of(page)
    for name, most in (("points", 60_000), ("gaussians", 100_000)):
        dots = data[name]
        places = np.frombuffer(base64.b64decode(dots["xyz"]), "<u2").reshape(-1, 3) / 65535 * dots["span"] + dots["low"]
        assert 0.4 * most < len(places) <= most
        assert (places[:, :2] >= np.array(data["low"][:2]) - 0.01).all()
        assert (places[:, :2] <= np.array(data["low"][:2]) + data["span"] + 0.01).all()
    assert np.frombuffer(base64.b64decode(data["gaussians"]["opacity"]), "u1").min() >= 25, "faint ones are left out"
    assert page.stat().st_size < 5e6


def test_the_page_asks_for_nothing_and_hostile_text_is_text(tmp_path):
    text = page_of(tmp_path).read_text(encoding="utf-8")
    assert len(re.findall(r"<script", text)) == 3, "the library, the data, the page's own"
    assert "The MIT License" in text and "three.js authors" in text
    own = re.sub(r"http://www\.w3\.org/\S+|https://jcgt\.org\S+", "", text)
    assert not re.findall(r"""(?:src|href)\s*=\s*["']https?:|fetch\(|XMLHttpRequest|importScripts""", own)
    assert data_of(tmp_path / "report_3d.html")["plots"][0]["name"] == HOSTILE


def test_a_file_of_somebody_else_stays(tmp_path):
    (tmp_path / "report_3d.html").write_text("<p>my own page</p>")
    with pytest.raises(OutputError, match="was not written by TreeDGS"):
        page_of(tmp_path)
    assert (tmp_path / "report_3d.html").read_text() == "<p>my own page</p>"


#: Counts pixels of the stems' colour, chooses tree 3 by a click on it, hides the measured ones, counts again.
CLICK = """
(function () {
  var canvas = document.getElementById("view"), said = [];
  function green() {
    stand.render();
    var gl = canvas.getContext("webgl2"), pixels = new Uint8Array(canvas.width * canvas.height * 4), count = 0;
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    for (var i = 0; i < pixels.length; i += 4) if (pixels[i + 1] > Math.max(pixels[i], pixels[i + 2]) + 25) count += 1;
    return count;
  }
  said.push(green());
  var box = canvas.getBoundingClientRect(), at = stand.screen(3, 0.2), card = document.getElementById("tree");
  ["pointerdown", "pointerup"].forEach(function (kind) {
    canvas.dispatchEvent(new PointerEvent(kind, { clientX: box.left + at.x, clientY: box.top + at.y, pointerId: 1 }));
  });
  said.push(card.dataset.tree, card.textContent, card.querySelector("a").getAttribute("href"));
  document.querySelector("[name=ok]").click();
  said.push(green(), document.title);
  var out = document.createElement("pre");
  out.id = "said"; out.textContent = JSON.stringify(said); document.body.appendChild(out);
})();
"""


@pytest.mark.skipif(not shutil.which("chromium"), reason="needs a browser (chromium)")
@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_shows_the_stems_from_the_file_and_answers_a_click(tmp_path, width):
    ortho = tmp_path / "ortho.tif"
    with rasterio.open(
        ortho, "w", driver="GTiff", width=200, height=200, count=3, dtype="uint8", crs="EPSG:6344",
        transform=from_origin(X - 5, Y + 15, 0.1, 0.1),
    ) as target:  # fmt: skip
        target.write(np.full((3, 200, 200), 120, np.uint8))
    xyz = np.random.default_rng(2).uniform([X, Y, 38], [X + 9, Y + 9, 50], (500, 3))
    page = page_of(tmp_path, orthophoto=ortho, points=Dots(xyz, np.full(xyz.shape, 90, np.uint8)))
    assert data_of(page)["picture"].startswith("data:image/jpeg;base64,")
    text = page.read_text(encoding="utf-8").replace("</body>", f"<script>{CLICK}</script></body>")
    page.write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["chromium", "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", f"--window-size={width},800", f"--user-data-dir={tmp_path / 'profile'}",
         "--virtual-time-budget=8000", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    said = json.loads(unescape(re.search(r"<pre id=\"said\">(.*?)</pre>", done.stdout, re.DOTALL)[1]))
    assert said[1] == "3" and "DBH 31.2 ± 0.4 cm" in said[2] and said[3] == "the%20sheets/3.jpg"
    assert said[0] > 200 and said[4] < 20, "the only green stem is drawn, and hidden"
    assert said[5] == "The stand in 3D"
