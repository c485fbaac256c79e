"""The dock **Review trees**: walks through the trees that want a look, and keeps what a person decides."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress

from qgis.core import QgsGeometry, QgsPointXY, QgsProject
from qgis.gui import QgsRubberBand
from qgis.PyQt.QtGui import QColor
from qgis.PyQt.QtWidgets import QDockWidget

from .. import compat
from ..i18n import tr
from . import rules, words
from .measuring import Measuring
from .rules import Refused
from .tools import PlaceTool, on_map
from .trees import Row, TreeLayer, tree_layers
from .widgets import Form, press_by_key

#: A click on the map means the tree within so many pixels.
NEAR_PIXELS = 15
#: Scale that *Zoom to* goes to, at most; the ring round the tree is this wide, m.
ZOOM_SCALE, RING_M = 120.0, 0.7


class ReviewPanel(QDockWidget):
    """See the module. iface: of QGIS."""

    def __init__(self, iface) -> None:
        super().__init__(tr("Review trees"), iface.mainWindow())
        self.setObjectName("TreeDGSReview")
        self.iface, self.canvas = iface, iface.mapCanvas()
        self.form = Form()
        self.setWidget(self.form)
        self._known: dict[str, TreeLayer] = {}
        self._tree: int | None = None
        self._list: list[Row] = []
        self._tool: PlaceTool | None = None
        self._before = None
        self._measuring: Measuring | None = None
        self._asked: tuple[int, float] | None = None
        #: Layer and number of the trees that were measured again here -> their DBH before, cm.
        self._before_cm: dict[tuple[str, int], float] = {}
        self._ring = QgsRubberBand(self.canvas, compat.LINE_STRING)
        self._ring.setColor(QColor("#0050d0"))
        self._ring.setWidth(3)
        for key, label in words.SHOWN.items():
            self.form.which.addItem(tr(label), key)
        self.form.undecided.setChecked(True)
        self._connect()
        self.list_layers()

    def _connect(self) -> None:
        form = self.form
        form.layer.currentIndexChanged.connect(lambda _: self.refresh())
        form.which.currentIndexChanged.connect(lambda _: self.refresh())
        form.undecided.toggled.connect(lambda _: self.refresh())
        form.previous.clicked.connect(lambda: self.go(-1))
        form.next.clicked.connect(lambda: self.go(1))
        form.zoom.clicked.connect(self.zoom)
        form.accept.clicked.connect(lambda: self.decide(lambda t, row: t.accept(row, self._note())))
        form.reject.clicked.connect(lambda: self.decide(lambda t, row: t.reject(row, self._note())))
        form.tape.clicked.connect(self.tape)
        form.taped.returnPressed.connect(self.tape)
        form.merge.clicked.connect(self.merge)
        form.other.returnPressed.connect(self.merge)
        form.pick.toggled.connect(lambda on: self._use_tool(form.pick, self.merge_at) if on else self._end_tool())
        form.again.toggled.connect(lambda on: self._use_tool(form.again, self.again_at) if on else self._end_tool())
        form.former.clicked.connect(self.take_former)
        form.stem.toggled.connect(lambda on: self._use_tool(form.stem, self.stem_at) if on else self._end_tool())
        form.keep_note.clicked.connect(lambda: self.decide(lambda t, row: t.note(row, self._note()), stay=True))
        form.take_back.clicked.connect(lambda: self.decide(lambda t, row: t.take_back(row), stay=True))
        form.undo.clicked.connect(self.undo)
        self._shortcuts = press_by_key(form)
        self.visibilityChanged.connect(self._shown)
        QgsProject.instance().layersAdded.connect(self._layers_changed)
        QgsProject.instance().layersRemoved.connect(self._layers_changed)

    def close_for_good(self) -> None:
        """The plugin is unloaded."""
        self._end_tool()
        QgsProject.instance().layersAdded.disconnect(self._layers_changed)
        QgsProject.instance().layersRemoved.disconnect(self._layers_changed)
        self.canvas.scene().removeItem(self._ring)

    # layers and rows

    def _layers_changed(self, _layers) -> None:
        self.list_layers()

    def list_layers(self) -> None:
        """The tree layers of the project; the one chosen stays."""
        box, found = self.form.layer, tree_layers()
        chosen, ids = box.currentData(), [layer.id() for layer in found]
        self._known = {key: known for key, known in self._known.items() if key in ids}
        box.blockSignals(True)
        box.clear()
        for layer in found:
            box.addItem(layer.name(), layer.id())
        active = self.iface.activeLayer()
        wanted = chosen if chosen in ids else active.id() if active is not None and active.id() in ids else None
        box.setCurrentIndex(ids.index(wanted) if wanted is not None else (0 if ids else -1))
        box.blockSignals(False)
        self.refresh()

    @property
    def trees(self) -> TreeLayer | None:
        """The layer chosen."""
        key = self.form.layer.currentData()
        layer = QgsProject.instance().mapLayer(key) if key else None
        if layer is None:
            return None
        return self._known.setdefault(key, TreeLayer(layer))

    @property
    def row(self) -> Row | None:
        """The tree that is shown."""
        return next((row for row in self._list if row.tree_id == self._tree), None)

    def refresh(self) -> None:
        """Read the layer again and show the tree that was shown, or the one after it."""
        trees = self.trees
        rows = trees.rows() if trees is not None else []
        which = self.form.which.currentData()
        self.form.undecided.setEnabled(which != "decided")
        self._list = [row for row in rows if self._is_wanted(row, which)]
        numbers = [row.tree_id for row in self._list]
        if self._tree not in numbers:
            after = [number for number in numbers if self._tree is not None and number > self._tree]
            self._tree = after[0] if after else numbers[0] if numbers else None
        wanting = [row for row in rows if row.flag in words.FLAGS["open"]]
        if which == "open" and rows and not wanting:  # a clean run: there is nothing to check, all can be looked at
            self.form.which.setCurrentIndex(self.form.which.findData("all"))
            return
        done = sum(bool(row.decision) for row in wanting)
        others = sum(bool(row.decision) for row in rows) - done
        text = tr("Decided: {done} of {all} to check or without a DBH, {others} of the other {rest}.").format(
            done=done, all=len(wanting), others=others, rest=len(rows) - len(wanting)
        )
        self.form.progress.setText(text if trees is not None else "")
        self._show()

    def _is_wanted(self, row: Row, which: str) -> bool:
        if which == "decided":
            return bool(row.decision)
        # The tree on show stays on show while it is looked at, decided or not.
        if self.form.undecided.isChecked() and row.decision and row.tree_id != self._tree:
            return False
        return which == "all" or row.flag in words.FLAGS[which]

    def _show(self) -> None:
        form, row, trees = self.form, self.row, self.trees
        for widget in (form.accept, form.reject, form.tape, form.taped, form.merge, form.other, form.pick):
            widget.setEnabled(row is not None)
        for widget in (form.zoom, form.previous, form.next, form.note, form.keep_note, form.take_back):
            widget.setEnabled(row is not None)
        form.again.setEnabled(row is not None)
        form.former.setEnabled(self._key in self._before_cm)
        form.stem.setEnabled(trees is not None)
        form.note.setEnabled(trees is not None)
        form.undo.setEnabled(trees is not None and trees.can_undo)
        form.taped.clear()
        form.other.clear()
        self._ring.reset(compat.LINE_STRING)
        if row is None or trees is None:
            form.headline.setText(
                tr("No tree layer in the project: add trees.gpkg.")
                if trees is None
                else tr("No such tree is left; choose 'all' to see every tree.")
            )
            form.colour("")
            for label in (form.numbers, form.reasons, form.decision, form.place):
                label.setText("")
            form.sheet.setVisible(False)
            form.hint.setVisible(False)
            form.note.clear()
            return
        number = [entry.tree_id for entry in self._list].index(row.tree_id) + 1
        form.place.setText(tr("{number} of {all}").format(number=number, all=len(self._list)))
        form.headline.setText(words.headline(row))
        form.colour(row.flag)
        form.numbers.setText(words.numbers(row))
        said = rules.reasons_in_words(str(row.values.get("qc_reason") or ""))
        form.reasons.setText("\n".join(f"• {meaning}" + (f": {action}" if action else "") for meaning, action in said))
        form.reasons.setVisible(bool(said))
        form.decision.setText(words.decision(row))
        form.note.setText(rules.own_note(row.note))
        form.sheet.setVisible(True)
        form.sheet.show_sheet(trees.sheet(row))
        form.hint.setVisible(bool(form.sheet.path))
        self._mark(row, trees)

    def _mark(self, row: Row, trees: TreeLayer) -> None:
        """A ring round the tree, and the tree on the map."""
        point = QgsPointXY(row.x, row.y)
        if self.isVisible():
            self._ring.setToGeometry(
                QgsGeometry.fromPointXY(point).buffer(RING_M, 24).convertToType(compat.LINE_STRING), trees.layer
            )
            place = on_map(point, self.canvas, trees.layer)
            if not self.canvas.extent().contains(place):
                self.canvas.setCenter(place)
                self.canvas.refresh()

    # walking

    def go(self, step: int) -> None:
        """To the next (1) or previous (-1) tree of the list, round its ends."""
        numbers = [row.tree_id for row in self._list]
        if not numbers:
            return
        at = numbers.index(self._tree) if self._tree in numbers else -1
        self.show_tree(numbers[(at + step) % len(numbers)])

    def show_tree(self, number: int) -> None:
        """Show a tree of the list."""
        self._tree = number
        self._say("")
        self.refresh()

    def zoom(self) -> None:
        """The map close to the tree."""
        row, trees = self.row, self.trees
        if row is None or trees is None:
            return
        self.canvas.setCenter(on_map(QgsPointXY(row.x, row.y), self.canvas, trees.layer))
        self.canvas.zoomScale(min(self.canvas.scale(), ZOOM_SCALE))
        self.canvas.refresh()

    # deciding

    def _note(self) -> str:
        return self.form.note.text().strip()

    def decide(self, action: Callable[[TreeLayer, Row], str], stay: bool = False) -> None:
        """Do ``action`` to the tree on show; what it says is shown, then comes the next tree."""
        row, trees = self.row, self.trees
        if row is None or trees is None:
            return
        numbers = [entry.tree_id for entry in self._list]
        following = numbers[(numbers.index(row.tree_id) + 1) % len(numbers)]
        try:
            said = action(trees, row)
        except Refused as problem:
            self._say(str(problem))
            return
        now = next((entry for entry in trees.rows() if entry.fid == row.fid), row)
        done = f"{tr('Tree')} {row.tree_id}: {words.meaning(now) or tr('Not decided yet.')}"
        before = words.meaning(row)
        if before in ("", words.meaning(now)):
            replaced = ""
        else:
            replaced = tr("Before: {meaning}; Undo last step (U) brings it back.").format(meaning=before)
        # Stays where something is to be looked at.
        self._tree = row.tree_id if stay or said else following
        self._say("\n".join(part for part in (done, replaced, said) if part))
        self.refresh()

    def tape(self) -> None:
        """The DBH typed; without one, to where it is typed."""
        text = self.form.taped.text()
        if not text.strip():
            self.form.taped.setFocus()
            return
        self.decide(lambda trees, row: trees.tape(row, self._sure(row, rules.taped_cm(text)), self._note()))

    def _sure(self, row: Row, cm: float) -> float:
        """The DBH, once a person has given one that is far from the measured one twice."""
        measured, self._asked, before = row.values.get("dbh_cm"), (row.tree_id, cm), self._asked
        if measured is None or abs(float(measured) - cm) <= rules.ASK * float(measured) or before == self._asked:
            return cm
        text = tr(
            "Tree {tree}: taped {taped} cm, but measured {measured} cm. Is it this tree and this number? Press "
            "Taped DBH (D) again to keep it, or type another number."
        )
        raise Refused(text.format(tree=row.tree_id, taped=f"{cm:.1f}", measured=f"{float(measured):.1f}"))

    def merge(self) -> None:
        """The number typed; without one, to where it is typed."""
        text = self.form.other.text().strip()
        if not text:
            self.form.other.setFocus()
            return
        if not text.isdecimal():
            self._say(tr("Found '{text}', expected the number of a tree.").format(text=text))
            return
        self.decide(lambda trees, row: trees.merge(row, int(text), self._note()))

    def merge_at(self, place: QgsPointXY) -> None:
        """The same tree as the one clicked."""
        trees, row = self.trees, self.row
        near = self._nearest(place)
        if trees is None or row is None:
            return
        if near is None or near.tree_id == row.tree_id:
            self._say(tr("No other tree stands where you clicked; click on its symbol."))
            return
        self._end_tool()
        self.decide(lambda layer, own: layer.merge(own, near.tree_id, self._note()))

    def _nearest(self, place: QgsPointXY) -> Row | None:
        """The tree of the layer within :data:`NEAR_PIXELS` of a place, in the layer's CRS."""
        trees = self.trees
        rows = trees.rows() if trees is not None else []
        own = self._tree
        best = min(
            (row for row in rows if row.tree_id != own),
            key=lambda row: math.hypot(row.x - place.x(), row.y - place.y()),
            default=None,
        )
        if best is None or trees is None:
            return None
        one, other = (on_map(p, self.canvas, trees.layer) for p in (QgsPointXY(best.x, best.y), place))
        pixels = math.hypot(one.x() - other.x(), one.y() - other.y()) / max(self.canvas.mapUnitsPerPixel(), 1e-12)
        return best if pixels <= NEAR_PIXELS else None

    def stem_at(self, place: QgsPointXY) -> None:
        """A stem that the layer does not have; measured at once where that is wanted."""
        trees = self.trees
        if trees is None:
            return
        self._end_tool()
        try:
            number = trees.add_stem(place, self.form.note.text().strip() if self.row is None else "")
        except Refused as problem:
            self._say(str(problem))
            return
        self.show_any(number)
        self._say(tr("Tree {tree} was added: a stem without a DBH.").format(tree=number))
        if self.form.measure.isChecked():
            self._measure([(number, place)])

    def show_any(self, number: int) -> None:
        """Show a tree, whether or not it is among those shown."""
        self._tree = number
        self.refresh()
        if self._tree != number:  # not among those shown
            self.form.which.setCurrentIndex(self.form.which.findData("all"))
            self._tree = number
            self.refresh()

    @property
    def _key(self) -> tuple[str, int]:
        """The layer and the tree on show."""
        return str(self.form.layer.currentData()), self._tree or 0

    def again_at(self, place: QgsPointXY) -> None:
        """The tree on show, measured again with its foot where a person sees it."""
        self._end_tool()
        if self.row is None:
            return
        cm = self.row.values.get("dbh_cm")
        if cm is not None:
            self._before_cm.setdefault(self._key, float(cm))
        self._measure([(self.row.tree_id, place)], "" if cm is None else "again ")

    def take_former(self) -> None:
        """The tree on show as it was before it was measured again."""
        if self.row is not None and self._before_cm.pop(self._key, None) is not None:
            self._measure([(self.row.tree_id, QgsPointXY(self.row.x, self.row.y))], "former ")

    def _moved(self, trees: TreeLayer, asked: tuple[int, QgsPointXY], near: Row) -> None:
        """A stem whose foot was moved far has become another row, right there: the former one is the same tree."""
        number, place = asked
        former = next((row for row in trees.rows() if row.tree_id == number), None)
        there = math.hypot(near.x - place.x(), near.y - place.y()) <= rules.known()["beside_m"]
        if former is not None and there and near.tree_id != number:
            with suppress(Refused):  # where it cannot be, both stay and a person decides
                trees.merge(former, near.tree_id)

    def _measure(self, places: list[tuple[int, QgsPointXY]], asked: str = "") -> None:
        """asked: before a tree's number, what the engine is to do with it (``--at``)."""
        trees = self.trees
        if trees is None:
            return
        if self._measuring is not None:
            self._say(tr("Another stem is being measured; wait for it."))
            return
        try:
            self._measuring = Measuring(
                trees, places, lambda done, text: self._measured(trees, places, done, text), asked
            )
        except (Refused, OSError) as problem:
            self._say(str(problem))
            return
        self._say(tr("Tree {tree} is being measured …").format(tree=places[0][0]))

    def _measured(self, trees: TreeLayer, places: list[tuple[int, QgsPointXY]], done: bool, text: str) -> None:
        """Another program wrote the file: its rows may have other numbers now."""
        self._measuring = None
        trees.forget_steps()
        place = places[0][1]
        near = min(trees.rows(), key=lambda row: math.hypot(row.x - place.x(), row.y - place.y()), default=None)
        if done and near is not None:
            self._moved(trees, places[0], near)
        if self.trees is trees and near is not None:
            self.show_any(near.tree_id)
        if done and near is not None:
            text = f"{words.headline(near)}\n{words.numbers(near).splitlines()[0]}"
            if (before := self._before_cm.get(self._key)) is not None:
                text += "\n" + tr("Before: {cm} cm; press As it was (W) to go back.").format(cm=f"{before:.1f}")
        self._say(text)

    def undo(self) -> None:
        """Take back what the panel did last in this layer, and show that tree."""
        trees = self.trees
        if trees is None or not trees.can_undo:
            return
        try:
            number = trees.undo()
        except Refused as problem:
            self._say(str(problem))
            return
        self._tree = number if number is not None else self._tree
        self._say(tr("The last step was taken back."))
        self.refresh()

    def _say(self, text: str) -> None:
        self.form.message.setText(text)
        self.form.message.setVisible(bool(text))

    # map tools

    def _use_tool(self, button, clicked: Callable[[QgsPointXY], None]) -> None:
        trees = self.trees
        if trees is None:
            return
        for other in (self.form.pick, self.form.stem, self.form.again):
            if other is not button and other.isChecked():
                other.setChecked(False)
        self._before = self.canvas.mapTool()
        self._tool = PlaceTool(self.canvas, trees.layer, clicked, self._end_tool)
        self.canvas.setMapTool(self._tool)
        self._say(tr("Click on the map; the right button or Esc ends it."))

    def _end_tool(self) -> None:
        tool, self._tool = self._tool, None
        if tool is not None:
            self.canvas.unsetMapTool(tool)
            if self._before is not None:
                self.canvas.setMapTool(self._before)
            self._before = None
        for button in (self.form.pick, self.form.stem, self.form.again):
            button.blockSignals(True)
            button.setChecked(False)
            button.blockSignals(False)

    def _shown(self, visible: bool) -> None:
        if visible:
            self.list_layers()
        else:
            self._end_tool()
            self._ring.reset(compat.LINE_STRING)
