"""The repository root is the QGIS plugin; QGIS calls :func:`classFactory` and nothing else lives here."""


def classFactory(iface):
    """Make the plugin. ``iface`` is ``None`` under ``qgis_process``."""
    from .treedgs_qgis.plugin import TreeDGSPlugin

    return TreeDGSPlugin(iface)
