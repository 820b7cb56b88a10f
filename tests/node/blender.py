# Imports garments into Blender and prints what their materials became (viewers.mjs).
import json
import sys

import bpy
import numpy

# The importer of Debian 12's Blender uses a name that Debian 12's numpy has no more.
numpy.bool = bool

answers = []
for path in sys.argv[sys.argv.index('--') + 1:]:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    assert 'FINISHED' in bpy.ops.import_scene.gltf(filepath=path)
    answer = {}
    for item in bpy.data.objects:
        if item.type != 'MESH':
            continue
        for polygon in item.data.polygons:
            material = item.data.materials[polygon.material_index]
            shown = answer.setdefault(material.name, {'triangles': 0})
            shown['triangles'] += len(polygon.vertices) - 2
    for name, shown in answer.items():
        core = next(node for node in bpy.data.materials[name].node_tree.nodes if node.type == 'BSDF_PRINCIPLED')
        colour = core.inputs['Base Color']
        shown['picture'] = colour.is_linked and colour.links[0].from_node.type == 'TEX_IMAGE'
        shown['metallic'] = core.inputs['Metallic'].default_value
        shown['roughness'] = core.inputs['Roughness'].default_value
    answers.append(answer)
print('answers', json.dumps(answers))
