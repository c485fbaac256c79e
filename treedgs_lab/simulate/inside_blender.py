"""Run by Blender's own Python (imported by a test alone): crowns by its add-on Sapling, photos by Cycles.

blender -b --factory-startup --python inside_blender.py -- grow CROWNS.json CROWNS.npz
blender -b --factory-startup --python inside_blender.py -- render SCENE.npz PHOTOS.json FOLDER

:mod:`.cycles` writes what it reads. Units are metres, the frame is the plot's.
"""

import ast
import json
import sys
from math import log2, pi
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix, Quaternion

#: Barks in the order of ``barks.BARKS``: dark and light colour, pattern, its cells a metre across and the share of
#: that along the stem, and where between dark and light the pattern turns.
BARKS = (
    ((0.035, 0.026, 0.020), (0.200, 0.150, 0.118), "cells", 24.0, 0.28, 0.02, 0.30),
    ((0.210, 0.205, 0.190), (0.360, 0.350, 0.330), "noise", 9.0, 1.00, 0.30, 0.70),
    ((0.060, 0.055, 0.050), (0.600, 0.580, 0.540), "noise", 16.0, 3.50, 0.33, 0.45),
    ((0.018, 0.016, 0.013), (0.150, 0.138, 0.122), "noise", 36.0, 0.12, 0.38, 0.62),
    ((0.085, 0.050, 0.032), (0.300, 0.175, 0.110), "cells", 18.0, 0.50, 0.00, 0.35),
    ((0.200, 0.190, 0.175), (0.420, 0.400, 0.370), "noise", 40.0, 0.05, 0.35, 0.65),
)
MOSS, LICHEN = (0.11, 0.17, 0.04, 1), (0.29, 0.32, 0.26, 1)
#: Exposure that shows the sky of a clear day, and an overcast one, as a camera would, stops.
CLEAR_STOPS, OVERCAST_STOPS = -1.1, 1.2
#: So many times as many paths where Blender was built without its denoiser.
UNDENOISED = 4
IDENTITY = np.eye(4)[None]


def grow(recipes, target):
    """One crown a recipe (preset of Sapling, what is changed of it) without its stem: leaves (N, 4, 3), wood (M, 3, 3),
    and the height of the whole tree."""
    import addon_utils  # there once bpy is imported

    if addon_utils.enable("add_curve_sapling") is None:
        sys.exit("Sapling is missing")
    presets = Path(str(sys.modules["add_curve_sapling"].__file__)).parent / "presets"
    known = bpy.ops.curve.tree_add.get_rna_type().properties.keys()
    made = {}
    for number, recipe in enumerate(recipes):
        text = (presets / f"{recipe['preset']}.py").read_text()
        settings = {**ast.literal_eval(text[text.index("{") :]), **recipe["changes"], "showLeaves": True}
        bpy.ops.wm.read_factory_settings(use_empty=True)
        addon_utils.enable("add_curve_sapling")
        bpy.ops.curve.tree_add(do_update=True, **{key: value for key, value in settings.items() if key in known})
        tree = next(item for item in bpy.data.objects if item.type == "CURVE")
        leaves = next(item for item in bpy.data.objects if item.type == "MESH")
        stem = tree.data.splines[0]
        made[f"height_{number}"] = max(point.co[2] for point in stem.bezier_points)
        tree.data.splines.remove(stem)
        mesh = tree.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        mesh.calc_loop_triangles()
        corners = np.empty(3 * len(mesh.loop_triangles), np.int32)
        mesh.loop_triangles.foreach_get("vertices", corners)
        made[f"wood_{number}"] = places(mesh)[corners].reshape(-1, 3, 3)
        made[f"leaves_{number}"] = places(leaves.data).reshape(-1, 4, 3)
    np.savez(target, **made)


def places(mesh):
    """(V, 3) vertices of a mesh."""
    found = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", found)
    return found.reshape(-1, 3)


def make_mesh(name, vertices, polygons, smooth=False):
    """(V, 3) places and (F, k) corners as a mesh of Blender."""
    mesh = bpy.data.meshes.new(name)
    count, corners = polygons.shape
    mesh.vertices.add(len(vertices))
    mesh.vertices.foreach_set("co", np.ascontiguousarray(vertices, np.float32).ravel())
    mesh.loops.add(count * corners)
    mesh.loops.foreach_set("vertex_index", np.ascontiguousarray(polygons, np.int32).ravel())
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, count * corners, corners, dtype=np.int32))
    mesh.polygons.foreach_set("loop_total", np.full(count, corners, np.int32))
    mesh.polygons.foreach_set("use_smooth", np.full(count, smooth))
    mesh.update(calc_edges=True)
    return mesh


def paint(mesh, name, domain, colours):
    """(N, 4) colours of a mesh's points or faces."""
    layer = mesh.attributes.new(name, "FLOAT_COLOR", domain)
    layer.data.foreach_set("color", np.ascontiguousarray(colours, np.float32).ravel())


def loose(name, corners):
    """(F, k, 3) loose polygons as a mesh."""
    count, size = corners.shape[:2]
    return make_mesh(name, corners.reshape(-1, 3), np.arange(count * size).reshape(count, size))


def put(mesh, material, matrices=IDENTITY):
    """A mesh in the scene, once for each (4, 4) matrix; returns those things."""
    mesh.materials.append(material)
    things = []
    for matrix in matrices:
        thing = bpy.data.objects.new(mesh.name, mesh)
        thing.matrix_world = Matrix(matrix.tolist())
        bpy.context.collection.objects.link(thing)
        things.append(thing)
    return things


class Nodes:
    """A material as a chain of calls; what a call returns is wired into the next."""

    def __init__(self, name):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()

    def add(self, kind, inputs=(), output=0, **settings):
        """One node; inputs: name or number of a socket -> value or another node's output. Returns its output."""
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for key, value in settings.items():
            setattr(node, key, value)
        for key, value in dict(inputs).items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[key])
            else:
                node.inputs[key].default_value = (*value, 1.0)[:4] if node.inputs[key].type == "RGBA" else value
        return node.outputs[output]

    def math(self, operation, *values):
        """A number made of numbers."""
        return self.add("Math", enumerate(values), operation=operation)

    def ramp(self, value, low, high):
        """0 below ``low``, 1 above ``high``, straight between them."""
        return self.add("MapRange", {"Value": value, "From Min": low, "From Max": high})

    def mix(self, share, first, second, blend="MIX"):
        """Colours mixed."""
        return self.add("MixRGB", {"Fac": share, "Color1": first, "Color2": second}, blend_type=blend)

    def place(self, across, along):
        """The place in the world, stretched."""
        here = self.add("TexCoord", output="Object")
        return self.add("VectorMath", {0: here, 1: (across, across, along)}, operation="MULTIPLY")

    def noise(self, place, scale, detail=3.0):
        """Noise about 0.5."""
        return self.add("TexNoise", {"Vector": place, "Scale": scale, "Detail": detail, "Roughness": 0.6})

    def finish(self, shader):
        """The material itself."""
        end = self.tree.nodes.new("ShaderNodeOutputMaterial")
        self.tree.links.new(shader, end.inputs["Surface"])
        return self.material


def photographed(nodes, tile):
    """Colour of a (h, w, 3) tile, root code, where the stems' layer ``place`` has it; and how light that is."""
    height, width = tile.shape[:2]
    image = bpy.data.images.new(nodes.material.name, width, height, float_buffer=True, is_data=True)
    image.pixels.foreach_set(np.dstack([(tile / 255.0) ** 2, np.ones((height, width))]).astype(np.float32).ravel())
    place = nodes.add("Attribute", attribute_name="place", output="Vector")
    tone = nodes.add("TexImage", {"Vector": place}, image=image)
    return nodes.math("POWER", nodes.add("RGBToBW", {"Color": tone}), 0.5), tone


def grown(nodes, row):
    """Bark of one kind: how light it is between its darkest and lightest, and its colour."""
    dark, light, pattern, cells, stretch, low, high = row
    place = nodes.place(1.0, stretch)
    wander = nodes.add("TexNoise", {"Vector": place, "Scale": 0.6 * cells}, output="Color")
    bent = nodes.mix(0.02, place, wander, "ADD")
    if pattern == "cells":
        relief = nodes.add(
            "TexVoronoi", {"Vector": bent, "Scale": cells}, output="Distance", feature="DISTANCE_TO_EDGE"
        )
    else:
        relief = nodes.noise(bent, cells)
    fine = nodes.noise(nodes.place(1.0, 0.4), 110.0)
    share = nodes.math("MULTIPLY", nodes.ramp(relief, low, high), nodes.ramp(fine, 0.1, 0.7))
    return share, nodes.mix(share, dark, light)


def bark_material(number, tiles):
    """Bark of one kind, or of a photograph; the stems' layer ``look`` says brightness, moss and lichen of each."""
    nodes = Nodes(f"bark {number}")
    share, tone = grown(nodes, BARKS[number]) if tiles is None else photographed(nodes, tiles[number])
    look = nodes.add("SeparateXYZ", {"Vector": nodes.add("Attribute", attribute_name="look", output="Vector")})
    separate = look.node
    for output, own, size in (("Z", LICHEN, 14.0), ("Y", MOSS, 7.0)):
        blotch = nodes.ramp(nodes.noise(nodes.place(1.0, 1.0), size), 0.35, 0.65)
        cover = nodes.ramp(nodes.math("SUBTRACT", separate.outputs[output], blotch), -0.06, 0.06)
        tone = nodes.mix(cover, tone, own)
    large = nodes.ramp(nodes.noise(nodes.place(1.0, 0.5), 1.7), 0.2, 0.8)
    bright = nodes.math("MULTIPLY", separate.outputs["X"], nodes.math("ADD", large, 0.55))
    tone = nodes.add("VectorMath", {0: tone, "Scale": bright}, operation="SCALE")
    bump = nodes.add("Bump", {"Height": share, "Strength": 0.7, "Distance": 0.012})
    return nodes.finish(nodes.add("BsdfDiffuse", {"Color": tone, "Roughness": 0.4, "Normal": bump}))


def ground_material():
    """Needles, leaves and twigs on soil, moss and grass in patches."""
    nodes = Nodes("litter")
    place = nodes.place(1.0, 1.0)
    cells = nodes.add("TexVoronoi", {"Vector": place, "Scale": 26.0}, output="Color")
    bits = nodes.add("SeparateXYZ", {"Vector": cells}).node
    leaf = nodes.mix(bits.outputs["X"], (0.055, 0.038, 0.026), (0.33, 0.235, 0.15))
    pale = nodes.ramp(bits.outputs["Y"], 0.90, 0.92)
    leaf = nodes.mix(pale, leaf, (0.52, 0.42, 0.31))
    # Needles: noise drawn out along two directions.
    streaks = [
        nodes.noise(nodes.add("Mapping", {"Vector": place, "Rotation": (0, 0, turn), "Scale": (14, 170, 1)}), 1.0, 1.0)
        for turn in (0.4, 2.1)
    ]
    needles = nodes.ramp(nodes.math("MAXIMUM", *streaks), 0.55, 0.72)
    floor = nodes.mix(nodes.math("MULTIPLY", needles, 0.75), leaf, (0.36, 0.24, 0.13))
    shade = nodes.math("ADD", nodes.noise(place, 0.35, 6.0), nodes.noise(place, 6.0, 2.0))
    floor = nodes.add("VectorMath", {0: floor, "Scale": nodes.math("POWER", shade, 1.6)}, operation="SCALE")
    blades = nodes.mix(nodes.noise(nodes.place(60.0, 60.0), 1.0, 2.0), (0.05, 0.05, 0.022), (0.21, 0.21, 0.09))
    green = nodes.ramp(nodes.noise(place, 0.55, 5.0), 0.54, 0.66)
    floor = nodes.mix(green, floor, blades)
    # Bits lie at all angles, some of them in the shade of others.
    tilt = nodes.math("ADD", nodes.math("MULTIPLY", bits.outputs["Z"], 0.6), 0.65)
    floor = nodes.add("VectorMath", {0: floor, "Scale": tilt}, operation="SCALE")
    return nodes.finish(nodes.add("BsdfDiffuse", {"Color": floor}))


def leafy(nodes, tone, through):
    """What leaves do with light: throw some back, let some through."""
    back = nodes.add("BsdfDiffuse", {"Color": tone})
    front = nodes.add("BsdfTranslucent", {"Color": tone})
    return nodes.finish(nodes.add("MixShader", {0: through, 1: back, 2: front}))


def crown_material(tone):
    """Leaves of a crown: no two alike, nor two trees."""
    nodes = Nodes("leaves")
    leaf = nodes.add("NewGeometry", output="Random Per Island")
    tree = nodes.add("ObjectInfo", output="Random")
    tone = nodes.mix(leaf, 0.6 * np.array(tone), 1.4 * np.array(tone))
    tone = nodes.mix(nodes.math("MULTIPLY", tree, 0.35), tone, (0.14, 0.13, 0.04))
    return leafy(nodes, tone, 0.35)


def plant_material():
    """Shrubs, grass, sticks, logs, ivy: each face has its own colour, and in alpha what it lets through."""
    nodes = Nodes("plants")
    own = nodes.add("Attribute", attribute_name="tone").node
    return leafy(nodes, own.outputs["Color"], own.outputs["Alpha"])


def build(scene):
    """Ground, stems, plants and crowns; returns what :func:`sway` moves: meshes, and crowns."""
    meshes, crowns = list[tuple](), list[tuple]()
    tiles = scene.get("bark_tiles")
    put(make_mesh("ground", scene["ground_vertices"], scene["ground_triangles"], True), ground_material())
    for kind in np.unique(scene["stem_bark"]):
        own = scene["stem_triangles"][scene["stem_bark"][scene["stem_owner"]] == kind]
        used, corners = np.unique(own, return_inverse=True)
        mesh = make_mesh(f"stems {kind}", scene["stem_vertices"][used], corners.reshape(-1, 3), True)
        paint(mesh, "look", "POINT", scene["stem_look"][used])
        if tiles is not None:
            paint(mesh, "place", "POINT", np.pad(scene["stem_place"][used], ((0, 0), (0, 2))))
        put(mesh, bark_material(kind, tiles))
        meshes.append((mesh, places(mesh), scene["vertex_owner"][used], scene["vertex_share"][used]))
    if len(scene["plant_corners"]):
        mesh = loose("plants", scene["plant_corners"])
        paint(mesh, "tone", "FACE", scene["plant_tone"])
        put(mesh, plant_material())
        meshes.append((mesh, places(mesh), scene["plant_owner"], scene["plant_share"]))
    nodes = Nodes("branches")
    wood = nodes.finish(nodes.add("BsdfDiffuse", {"Color": (0.15, 0.12, 0.09)}))
    for number in range(int(scene["crown_kinds"])):
        own = scene["instance_kind"] == number
        stands = [scene[f"instance_{name}"][own] for name in ("matrix", "owner", "height", "share")]
        things = put(loose("wood", scene[f"wood_{number}"]), wood, stands[0])
        if len(scene[f"leaves_{number}"]):
            things += put(
                loose("leaves", scene[f"leaves_{number}"]), crown_material(scene[f"tone_{number}"]), stands[0]
            )
        crowns += zip(things, *(np.resize(part, (len(things), *part.shape[1:])) for part in stands), strict=True)
    return meshes, crowns


def sway(meshes, crowns, tops):
    """Trees as they stand in one photo; tops: (S, 2) displacement of each. A crown is sheared, not bent."""
    for mesh, rest, owner, share in meshes:
        rest = rest.copy()
        rest[:, :2] += share[:, None] * tops[owner]
        mesh.vertices.foreach_set("co", rest.ravel())
        mesh.update()
    for thing, matrix, owner, (low, high), (at_low, at_high) in crowns:
        moved = np.eye(4)
        moved[:2, 2] = (at_high - at_low) / (high - low) * tops[owner]
        moved[:2, 3] = at_low * tops[owner] - low * moved[:2, 2]
        thing.matrix_world = Matrix((moved @ matrix).tolist())


def light(overcast):
    """Sky and sun; returns the node of the sky to be turned photo by photo, ``None`` where there is no sun."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    ground = world.node_tree.nodes["Background"]
    if overcast:
        ground.inputs["Color"].default_value = (0.92, 0.97, 1.03, 1)
        return None
    sky = world.node_tree.nodes.new("ShaderNodeTexSky")
    sky.sky_type = "NISHITA"
    world.node_tree.links.new(sky.outputs[0], ground.inputs["Color"])
    return sky


def set_up(job):
    """Renderer, look and camera of all photos."""
    import _cycles

    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = job["width"], job["height"]
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    scene.render.image_settings.file_format, scene.render.image_settings.tiff_codec = "TIFF", "NONE"
    scene.render.image_settings.color_mode, scene.render.image_settings.color_depth = "RGB", "16"
    scene.render.dither_intensity = 0.0
    scene.view_settings.view_transform = job["look"]
    scene.cycles.use_denoising = _cycles.with_openimagedenoise
    scene.cycles.samples = job["samples"] * (1 if scene.cycles.use_denoising else UNDENOISED)
    scene.cycles.use_adaptive_sampling = False
    # Light that is thrown back more than twice adds seconds, and hardly anything to be seen.
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.transmission_bounces = 2
    scene.cycles.sample_clamp_indirect = 4.0
    camera = bpy.data.cameras.new("camera")
    camera.sensor_width, camera.sensor_fit, camera.clip_end = 36.0, "HORIZONTAL", 2000.0
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.rotation_mode = "QUATERNION"
    scene.collection.objects.link(scene.camera)
    return scene


def move(scene, photo):
    """The camera of one photo; moving, from half the shutter's time before the photo to as much after it."""
    camera = scene.camera
    camera.animation_data_clear()
    scene.camera.data.lens = photo["focal_px"] * 36.0 / scene.render.resolution_x
    moving = photo["shutter"] > 0
    scene.render.use_motion_blur = moving
    if moving:
        scene.render.motion_blur_shutter = 1.0
        scene.cycles.motion_blur_position = "CENTER"
        scene.cycles.rolling_shutter_type = "TOP"
        scene.cycles.rolling_shutter_duration = photo["open_share"]
    base = Matrix(photo["axes"]).to_quaternion()
    # Keys two frames apart: the shutter is open for one of them.
    for frame, share in ((0, -1.0), (2, 1.0)) if moving else ((1, 0.0),):
        camera.location = np.add(photo["centre"], share * np.array(photo["travel"]))
        turn = Quaternion([1.0, *(0.5 * share * np.array(photo["turn"]))])
        camera.rotation_quaternion = base @ turn.normalized()
        if moving:
            camera.keyframe_insert("location", frame=frame)
            camera.keyframe_insert("rotation_quaternion", frame=frame)
    if moving:
        for curve in camera.animation_data.action.fcurves:
            for key in curve.keyframe_points:
                key.interpolation = "LINEAR"
    scene.frame_set(1)


def render(scene_file, job, folder):
    """Every photo of the job as a 16-bit TIFF; says which one is ready."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = set_up(job)
    meshes, crowns = build(np.load(scene_file))
    sky = light(job["overcast"])
    for photo in job["photos"]:
        scene.view_settings.exposure = log2(photo["gain"]) + (CLEAR_STOPS if sky else OVERCAST_STOPS)
        if sky:
            east, north, up = photo["sun"]
            sky.sun_elevation = float(np.arcsin(up))
            sky.sun_rotation = float(np.arctan2(east, north)) % (2 * pi)
        scene.cycles.seed = photo["seed"]
        if "tops" in photo:
            sway(meshes, crowns, np.array(photo["tops"]))
        move(scene, photo)
        scene.render.filepath = str(Path(folder) / photo["file"])
        bpy.ops.render.render(write_still=True)
        print("photo ready", photo["file"], flush=True)


if __name__ == "__main__":
    what, first, second, *rest = sys.argv[sys.argv.index("--") + 1 :]
    if what == "grow":
        grow(json.loads(Path(first).read_text()), second)
    else:
        render(first, json.loads(Path(second).read_text()), rest[0])
