"""A tree layer as the panel reads and writes it: rows, decisions, undo. Only the columns ``rev_*`` are written."""

from __future__ import annotations

import math
import os
import re
import statistics
from dataclasses import dataclass
from typing import Any

from qgis.core import QgsFeature, QgsGeometry, QgsPoint, QgsPointXY, QgsProject, QgsVectorLayer

from .. import compat
from ..i18n import tr
from .rules import APART, COLUMNS, NO_TREE, Refused, known, merge_note, merged_into, now, refuse_other_unit, user

#: By these a layer is known as one of trees; those of tapes, stand tables and pairs say nothing of a method.
MARKS = ("tree_id", "dbh_cm", "qc_flag", "method")
#: Between these the style of a layer names the folder of its evidence sheets.
_SHEETS = re.compile(r"file_path\(decode_uri\(@layer_id, 'path'\)\) \|\| '/' \|\| '((?:[^']|'')*)' \|\| '/'")
_LENGTHS = {"rev_flag": 16, "rev_note": 254, "rev_by": 80, "rev_at": 32}
#: Breast height of a stem that is added to a layer that says none, m (the engine's).
_BREAST_HEIGHT_M = 1.37


@dataclass(frozen=True)
class Row:
    """One tree of the layer; texts as in the file, ``None`` where there is no value. fid: of the feature."""

    fid: int
    tree_id: int
    values: dict[str, Any]
    x: float
    y: float

    @property
    def flag(self) -> str:
        """``ok``, ``check`` or ``reject``, as measured."""
        return str(self.values.get("qc_flag") or "")

    @property
    def decision(self) -> str:
        """A word of the decisions, or ''."""
        word = str(self.values.get("rev_flag") or "").strip().lower()
        return word or ("dbh" if self.values.get("rev_dbh_cm") is not None else "")

    @property
    def note(self) -> str:
        """``rev_note``."""
        return str(self.values.get("rev_note") or "")


@dataclass(frozen=True)
class _Step:
    """What undo brings back: the values before, or that the row was not there."""

    fid: int
    before: dict[str, Any] | None


def tree_layers(project: QgsProject | None = None) -> list[QgsVectorLayer]:
    """Tree layers of the project, by name."""
    layers = (project or QgsProject.instance()).mapLayers().values()
    found = [layer for layer in layers if isinstance(layer, QgsVectorLayer) and is_tree_layer(layer)]
    return sorted(found, key=lambda layer: layer.name())


def is_tree_layer(layer: QgsVectorLayer) -> bool:
    """Points with our columns."""
    names = {field.name() for field in layer.fields()} if layer.isValid() else set()
    return layer.isValid() and layer.geometryType() == compat.POINT and names.issuperset(MARKS)


class TreeLayer:
    """Rows and decisions of one layer."""

    def __init__(self, layer: QgsVectorLayer) -> None:
        self.layer = layer
        self._steps: list[_Step] = []

    def rows(self) -> list[Row]:
        """All trees, by number; a row without a number is left out."""
        names = [field.name() for field in self.layer.fields()]
        found = []
        for feature in self.layer.getFeatures():
            values = {name: _plain(feature[name]) for name in names}
            number, shape = values.get("tree_id"), feature.geometry()
            if number is None or shape.isNull():
                continue
            point = shape.asPoint() if not shape.isMultipart() else shape.asMultiPoint()[0]
            found.append(Row(feature.id(), int(float(number)), values, point.x(), point.y()))
        return sorted(found, key=lambda row: (row.tree_id, row.fid))

    # decisions

    def accept(self, row: Row, note: str = "") -> str:
        """The tree and its DBH are right; returns what is worth a second look, or ''."""
        self._decide(row, "accept", None, note)
        if row.values.get("dbh_cm") is None:
            return tr(
                "Tree {tree} has no DBH: it counts as a tree without one; give its taped DBH if you have it."
            ).format(tree=row.tree_id)
        return ""

    def reject(self, row: Row, note: str = "") -> str:
        """No tree stands here."""
        self._refuse_if_partner(row)
        self._decide(row, "reject", None, note)
        return ""

    def tape(self, row: Row, cm: float, note: str = "") -> str:
        """Its DBH is this."""
        measured = row.values.get("dbh_cm")
        refuse_other_unit(row.tree_id, cm, measured and float(measured), self._diameters())
        self._decide(row, "dbh", cm, note)
        if measured is None or abs(float(measured) - cm) <= APART * cm:
            return ""
        text = tr("Tree {tree}: taped {taped} cm, measured {measured} cm; check the number and that it is this tree.")
        return text.format(tree=row.tree_id, taped=f"{cm:.1f}", measured=f"{float(measured):.1f}")

    def _diameters(self) -> list[float]:
        """Measured DBHs of the layer, cm."""
        return [float(row.values["dbh_cm"]) for row in self.rows() if row.values.get("dbh_cm") is not None]

    def merge(self, row: Row, other: int, note: str = "") -> str:
        """The same tree as ``other``, which counts."""
        rows = {entry.tree_id: entry for entry in self.rows()}
        if other == row.tree_id or other not in rows:
            text = tr("Tree {tree} cannot be the same as {other}; give the number of another tree of this layer.")
            raise Refused(text.format(tree=row.tree_id, other=other))
        if rows[other].decision in NO_TREE:
            text = tr("Tree {other} counts nowhere itself (rejected, or merged): one of the two has to count.")
            raise Refused(text.format(other=other))
        self._refuse_if_partner(row)
        self._decide(row, "merge", None, merge_note(other, note))
        return ""

    def note(self, row: Row, note: str) -> str:
        """Only a note; the decision stays."""
        other = merged_into(row.note) if row.decision == "merge" else None
        text = note if other is None else merge_note(other, note)
        self._write(row.fid, {"rev_note": text or None, "rev_by": user() or None, "rev_at": now()})
        return ""

    def take_back(self, row: Row) -> str:
        """No decision any more."""
        self._write(row.fid, {**dict.fromkeys(COLUMNS), "rev_by": user() or None, "rev_at": now()})
        return ""

    def add_stem(self, place: QgsPointXY, note: str = "", cm: float | None = None) -> int:
        """A stem that nothing measured, at a place in the layer's CRS; returns its number.

        Raises:
            Refused: a tree stands there, or the place is not of this layer.
        """
        rows = self.rows()
        near = min(rows, key=lambda row: math.hypot(row.x - place.x(), row.y - place.y()), default=None)
        away = math.inf if near is None else math.hypot(near.x - place.x(), near.y - place.y())
        if near is not None and away <= known()["beside_m"]:
            text = tr("Tree {tree} stands {away} m from here; decide about that tree.")
            raise Refused(text.format(tree=near.tree_id, away=f"{away:.2f}"))
        if near is not None and away > known()["far_m"]:
            text = tr("This place lies {away} m from the nearest tree of the layer; click inside the plot.")
            raise Refused(text.format(away=f"{away:,.0f}"))
        if cm is not None:
            refuse_other_unit(max((row.tree_id for row in rows), default=0) + 1, cm, None, self._diameters())
        self._ensure_columns()
        fields = self.layer.fields()
        heights = [float(row.values["bh_m"]) for row in rows if row.values.get("bh_m") is not None]
        values = {
            "tree_id": max((row.tree_id for row in rows), default=0) + 1,
            "x": round(place.x(), 3),
            "y": round(place.y(), 3),
            "bh_m": statistics.median(heights) if heights else _BREAST_HEIGHT_M,
            "qc_flag": "reject",
            "qc_reason": "not_found",
            "rev_flag": "stem" if cm is None else "dbh",
            "rev_dbh_cm": cm,
            "rev_note": note or None,
            "rev_by": user() or None,
            "rev_at": now(),
        }
        feature = QgsFeature(fields)
        feature.setGeometry(QgsGeometry(QgsPoint(place.x(), place.y(), 0.0)))
        for name, value in values.items():
            if fields.indexOf(name) >= 0 and value is not None:
                feature.setAttribute(name, value)
        self._add(feature, tr("here stands a stem"))
        number = int(values["tree_id"])
        self._steps.append(_Step(next(row.fid for row in self.rows() if row.tree_id == number), None))
        return number

    # undo

    @property
    def can_undo(self) -> bool:
        """The panel wrote something into this layer."""
        return bool(self._steps)

    def undo(self) -> int | None:
        """Take the last step back; the tree's number, ``None`` where the row is gone."""
        step = self._steps.pop()
        row = next((row for row in self.rows() if row.fid == step.fid), None)
        if row is None:
            return None
        if step.before is None:
            self._delete(step.fid)
            return None
        self._write(step.fid, step.before, remember=False)
        return row.tree_id

    def forget_steps(self) -> None:
        """After another program wrote the file: rows may have other ids now."""
        self._steps.clear()

    # files

    def path(self) -> str:
        """The layer's file."""
        return self.layer.source().partition("|")[0]

    def sheets(self) -> str:
        """The folder of the evidence sheets as the layer's style names it, or ''."""
        found = _SHEETS.search(self.layer.mapTipTemplate() or "")
        if found is None or not os.path.isfile(self.path()):
            return ""
        return os.path.normpath(os.path.join(os.path.dirname(self.path()), found.group(1).replace("''", "'")))

    def sheet(self, row: Row) -> str:
        """The picture of a tree's evidence, or '' where there is none."""
        folder, run = self.sheets(), str(row.values.get("run_id") or "sheets")
        path = os.path.join(folder, run, f"{row.tree_id}.jpg") if folder and os.path.basename(run) == run else ""
        return path if os.path.isfile(path) else ""

    # writing

    def _decide(self, row: Row, word: str, cm: float | None, note: str) -> None:
        values = {
            "rev_flag": word,
            "rev_dbh_cm": cm,
            "rev_note": note or None,
            "rev_by": user() or None,
            "rev_at": now(),
        }
        self._write(row.fid, values)

    def _refuse_if_partner(self, row: Row) -> None:
        for other in self.rows():
            if other.decision == "merge" and merged_into(other.note) == row.tree_id:
                text = tr(
                    "Tree {other} is merged into tree {tree}, which therefore has to count; change that one first."
                )
                raise Refused(text.format(other=other.tree_id, tree=row.tree_id))

    def _write(self, fid: int, values: dict[str, Any], remember: bool = True) -> None:
        """The decision's columns of one row, saved at once; a layer that the user edits gets it into the edits."""
        assert set(values) <= set(COLUMNS)
        self._ensure_columns()
        fields = self.layer.fields()
        before = self.layer.getFeature(fid)
        old = {name: _plain(before[name]) for name in COLUMNS}
        changes = {fields.indexOf(name): value for name, value in values.items()}
        if self.layer.isEditable():
            self.layer.beginEditCommand(tr("Review trees"))
            done = all(self.layer.changeAttributeValue(fid, index, value) for index, value in changes.items())
            self.layer.endEditCommand()
        else:
            done = self.layer.dataProvider().changeAttributeValues({fid: changes})
        if not done:
            raise Refused(self._cannot_write())
        if remember:
            self._steps.append(_Step(fid, old))
        self.layer.triggerRepaint()

    def _add(self, feature: QgsFeature, what: str) -> None:
        if self.layer.isEditable():
            self.layer.beginEditCommand(what)
            done = self.layer.addFeature(feature)
            self.layer.endEditCommand()
        else:
            done = bool(self.layer.dataProvider().addFeatures([feature])[0])
        if not done:
            raise Refused(self._cannot_write())
        self.layer.updateExtents()
        self.layer.triggerRepaint()

    def _delete(self, fid: int) -> None:
        editing = self.layer.isEditable()
        done = self.layer.deleteFeature(fid) if editing else self.layer.dataProvider().deleteFeatures([fid])
        if not done:
            raise Refused(self._cannot_write())
        self.layer.triggerRepaint()

    def _ensure_columns(self) -> None:
        """Layers of earlier versions have no columns for decisions yet."""
        have = {field.name() for field in self.layer.fields()}
        missing = [name for name in COLUMNS if name not in have]
        if not missing:
            return
        made = [compat.new_field(name, None if name == "rev_dbh_cm" else _LENGTHS[name]) for name in missing]
        if self.layer.isEditable() or not self.layer.dataProvider().addAttributes(made):
            raise Refused(self._cannot_write())
        self.layer.updateFields()

    def _cannot_write(self) -> str:
        errors = [*self.layer.dataProvider().errors(), tr("the file cannot be changed")]
        text = tr("{layer}: nothing was written ({why}); close other programs that use the file, or save a copy of it.")
        return text.format(layer=self.layer.name(), why=errors[0])


def _plain(value: Any) -> Any:
    """``None`` for QGIS' NULL; dates as text."""
    nothing = getattr(value, "isNull", None)  # a QVariant without a value; a QDateTime without one
    if value is None or (nothing is not None and nothing()) or (isinstance(value, float) and math.isnan(value)):
        return None
    to_text = getattr(value, "toString", None)
    return to_text() if to_text is not None else value
