# Traces triangles in Blender's Cycles under one lamp after the other (tests/bench/cycles). Axes are ours, y upwards.
import json
import math
import sys

import bpy
import numpy
from mathutils import Matrix, Vector

asked = json.loads(sys.argv[-1])
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene


def add(name, data):
    scene.collection.objects.link(bpy.data.objects.new(name, data))
    return bpy.data.objects[name]


# Flat faces: with smooth normals yarn that lets light through loses a tenth of its light.
points = numpy.fromfile(asked['points'], numpy.float32).reshape(-1, 3)
mesh = bpy.data.meshes.new('yarn')
mesh.from_pydata(points.tolist(), [], numpy.arange(len(points)).reshape(-1, 3).tolist())
mesh.materials.append(bpy.data.materials.new('yarn'))
add('yarn', mesh)

# A wall that sends the fraction `transmission` of its light to the other side.
mesh.materials[0].use_nodes = True
tree = mesh.materials[0].node_tree
mix = tree.nodes.new('ShaderNodeMixShader')
mix.inputs[0].default_value = asked['transmission']
for socket, kind in enumerate(['ShaderNodeBsdfDiffuse', 'ShaderNodeBsdfTranslucent'], 1):
    side = tree.nodes.new(kind)
    side.inputs['Color'].default_value = [*asked['albedo'], 1]
    tree.links.new(side.outputs[0], mix.inputs[socket])
tree.links.new(mix.outputs[0], tree.nodes['Material Output'].inputs['Surface'])

azimuth, elevation, fov = (math.radians(asked[angle]) for angle in ('azimuth', 'elevation', 'fov'))
back = Vector((math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation)))
right = Vector((0, 1, 0)).cross(back).normalized()
scene.camera = add('camera', bpy.data.cameras.new('camera'))
scene.camera.matrix_world = Matrix.Translation(back * asked['distance']) @ Matrix((right, back.cross(right), back)).transposed().to_4x4()
scene.camera.data.sensor_fit, scene.camera.data.angle, scene.camera.data.clip_start = 'VERTICAL', fov, asked['distance'] / 100
sun = add('sun', bpy.data.lights.new('sun', 'SUN'))
sun.data.angle, sun.data.energy = 0, 1

scene.render.engine, scene.render.film_transparent = 'CYCLES', True
scene.render.resolution_x, scene.render.resolution_y = asked['width'], asked['height']
scene.render.image_settings.file_format, scene.render.image_settings.color_depth = 'OPEN_EXR', '32'
cycles = scene.cycles
cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising, cycles.pixel_filter_type = asked['samples'], False, False, 'BOX'
cycles.max_bounces, cycles.diffuse_bounces, cycles.transmission_bounces, cycles.sample_clamp_indirect = 64, 64, 64, 0
for lamp in asked['lamps']:
    sun.rotation_euler = Vector(lamp['light']).to_track_quat('Z', 'Y').to_euler()
    scene.render.filepath = lamp['picture']
    bpy.ops.render.render(write_still=True)
