"""TreeDGS: diameters at breast height from drone photos or LiDAR clouds.

The library computes; it never imports ``qgis``. Data flows one way:
geotags -> reconstruction -> gaussians -> stems -> measure -> inventory -> evaluation,
with ``core``, ``terrain`` and ``pointcloud`` below them all.
"""

__version__ = "0.2.0"
