"""The widgets of the panel and where they stand; what they do is in :mod:`.panel`."""

from __future__ import annotations

import os

from qgis.PyQt.QtCore import Qt, QUrl
from qgis.PyQt.QtGui import QDesktopServices, QKeySequence, QPixmap
from qgis.PyQt.QtWidgets import (
    QCheckBox,
    QComboBox,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from ..compat import QShortcut
from ..i18n import tr

#: flag -> ground and text of the headline, as on the map
COLOURS = {"ok": ("#2e7d32", "#ffffff"), "check": ("#f59e0b", "#1b1b1b"), "reject": ("#c62828", "#ffffff")}

#: Qt's own upper limit of a widget's height.
_ANY_HEIGHT = 16777215


def plain(text: str = "", wrap: bool = True) -> QLabel:
    """A label that shows any text as text."""
    label = QLabel(text)
    label.setTextFormat(Qt.TextFormat.PlainText)
    label.setWordWrap(wrap)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


class SheetPicture(QLabel):
    """The evidence sheet, as wide as the panel; a click opens it in full size."""

    def __init__(self) -> None:
        super().__init__()
        self.path = ""
        self._picture = QPixmap()
        self.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setWordWrap(True)
        self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)

    def show_sheet(self, path: str) -> None:
        """The picture of a file; words where there is none."""
        self.path = path
        self._picture = QPixmap(path) if path else QPixmap()
        if self._picture.isNull():
            self.setPixmap(QPixmap())
            self.setMinimumHeight(0)
            self.setMaximumHeight(_ANY_HEIGHT)
            self.setText(tr("No evidence sheet of this tree was found beside the layer."))
            self.unsetCursor()
            return
        self.setText("")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self._fit()

    def resizeEvent(self, event) -> None:
        """As wide as there is room."""
        super().resizeEvent(event)
        self._fit()

    def mouseReleaseEvent(self, event) -> None:
        """Open it."""
        if self.path and not self._picture.isNull():
            QDesktopServices.openUrl(QUrl.fromLocalFile(os.path.abspath(self.path)))

    def _fit(self) -> None:
        if not self._picture.isNull() and self.width() > 20:
            width = min(self.width(), self._picture.width())
            fitted = self._picture.scaledToWidth(width, Qt.TransformationMode.SmoothTransformation)
            self.setPixmap(fitted)
            self.setFixedHeight(fitted.height())


class Form(QWidget):
    """All widgets of the panel."""

    def __init__(self) -> None:
        super().__init__()
        self.layer, self.which, self.undecided = QComboBox(), QComboBox(), QCheckBox(tr("only those not decided yet"))
        self.previous, self.next = QPushButton(tr("◀ Previous (P)")), QPushButton(tr("Next (N) ▶"))
        self.zoom, self.place = QPushButton(tr("Zoom to (Z)")), plain("", wrap=False)
        self.headline, self.numbers, self.reasons, self.decision = plain(), plain(), plain(), plain()
        self.hint = plain(tr("Click the picture to see it in full size."))
        self.sheet, self.note, self.taped, self.other = SheetPicture(), QLineEdit(), QLineEdit(), QLineEdit()
        self.accept = QPushButton(tr("Accept (A)"))
        self.reject = QPushButton(tr("No tree here (X)"))
        self.tape = QPushButton(tr("Taped DBH (D)"))
        self.merge = QPushButton(tr("Same tree as (M)"))
        self.pick = QPushButton(tr("pick on the map"))
        self.stem = QPushButton(tr("Here stands a stem (S)"))
        self.again = QPushButton(tr("Its foot is here: measure again (B)"))
        self.former = QPushButton(tr("As it was (W)"))
        self.measure = QCheckBox(tr("measure it in the photos at once"))
        self.keep_note = QPushButton(tr("Save note"))
        self.take_back = QPushButton(tr("Take decision back (C)"))
        self.undo = QPushButton(tr("Undo last step (U)"))
        self.message, self.progress = plain(), plain()
        self._explain()
        self._lay_out()

    def _explain(self) -> None:
        self.hint.setStyleSheet("color: #666666;")
        self.decision.setStyleSheet("font-weight: bold;")
        self.message.setStyleSheet("color: #8a4b00;")
        self.note.setPlaceholderText(tr("a note (goes with the decision)"))
        self.taped.setPlaceholderText(tr("DBH, cm"))
        self.other.setPlaceholderText(tr("number"))
        self.taped.setMaximumWidth(90)
        self.other.setMaximumWidth(90)
        self.pick.setCheckable(True)
        self.stem.setCheckable(True)
        self.again.setCheckable(True)
        for widget, text in (
            (self.accept, tr("The tree and its DBH are right.")),
            (self.reject, tr("No tree stands here; it counts nowhere.")),
            (self.tape, tr("Its DBH was taped: type it in cm. The measured one stays beside it.")),
            (self.merge, tr("This is the same tree as another one, which counts.")),
            (self.stem, tr("Click on the map where a stem stands that the layer does not have.")),
            (self.again, tr("Click on the map where the foot of this stem is; it is measured there in the photos.")),
            (self.former, tr("Take the tree back to what it was before it was measured again.")),
            (self.take_back, tr("Take the decision about this tree back.")),
            (self.undo, tr("Take back what was done last in this panel.")),
        ):
            widget.setToolTip(text)

    def _lay_out(self) -> None:
        top = QGridLayout()
        top.addWidget(QLabel(tr("Trees")), 0, 0)
        top.addWidget(self.layer, 0, 1)
        top.addWidget(QLabel(tr("Show")), 1, 0)
        top.addWidget(self.which, 1, 1)
        top.addWidget(self.undecided, 2, 1)
        top.setColumnStretch(1, 1)
        middle = QVBoxLayout()
        for widget in (self.headline, self.decision, self.numbers, self.reasons, self.sheet, self.hint):
            middle.addWidget(widget)
        middle.addStretch(1)
        inside = QWidget()
        inside.setLayout(middle)
        area = QScrollArea()
        area.setWidgetResizable(True)
        area.setFrameShape(QFrame.Shape.NoFrame)
        area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        # The picture is as high as the room is wide: a bar that comes and goes would change that without end.
        area.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOn)
        area.setWidget(inside)
        below = QGridLayout()
        below.addWidget(self.accept, 0, 0)
        below.addWidget(self.reject, 0, 1, 1, 2)
        below.addWidget(self.tape, 1, 0)
        below.addWidget(self.taped, 1, 1, 1, 2)
        below.addWidget(self.merge, 2, 0)
        below.addWidget(self.other, 2, 1)
        below.addWidget(self.pick, 2, 2)
        below.addWidget(self.stem, 3, 0)
        below.addWidget(self.measure, 3, 1, 1, 2)
        below.addWidget(self.again, 4, 0, 1, 2)
        below.addWidget(self.former, 4, 2)
        below.addWidget(self.note, 5, 0, 1, 2)
        below.addWidget(self.keep_note, 5, 2)
        below.addWidget(self.take_back, 6, 0)
        below.addWidget(self.undo, 6, 1, 1, 2)
        below.setColumnStretch(0, 1)
        below.setColumnStretch(2, 1)
        whole = QVBoxLayout()
        whole.addLayout(top)
        whole.addLayout(_in_a_row(self.previous, self.place, self.next, self.zoom))
        whole.addWidget(area, 1)
        whole.addWidget(self.message)
        whole.addLayout(below)
        whole.addWidget(self.progress)
        self.setLayout(whole)

    def shortcuts(self) -> dict[str, QPushButton]:
        """Key -> the button that it presses."""
        return {
            "P": self.previous,
            "N": self.next,
            "Z": self.zoom,
            "A": self.accept,
            "X": self.reject,
            "D": self.tape,
            "M": self.merge,
            "S": self.stem,
            "B": self.again,
            "W": self.former,
            "C": self.take_back,
            "U": self.undo,
        }

    def colour(self, flag: str) -> None:
        """The headline in the colour of the map."""
        ground, text = COLOURS.get(flag, ("#777777", "#ffffff"))
        self.headline.setStyleSheet(f"font-weight: bold; padding: 5px; background: {ground}; color: {text};")


def press_by_key(form: Form) -> list[QShortcut]:
    """Each key of :meth:`Form.shortcuts` presses its button, while the panel has the focus and nothing is typed."""
    made = []
    for key, button in form.shortcuts().items():
        shortcut = QShortcut(QKeySequence(key), form)
        shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        shortcut.activated.connect(button.click)
        made.append(shortcut)
    return made


def _in_a_row(*widgets: QWidget) -> QHBoxLayout:
    row = QHBoxLayout()
    for widget in widgets:
        row.addWidget(widget)
    return row
