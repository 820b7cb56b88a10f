// Nodes, scenes, cameras, skins and animations (glTF 2.0, sections 3.5, 3.7.3, 3.10 and 3.11).

const QUATERNION_TOLERANCE = 0.0079, SKEW_TOLERANCE = 1e-3;
const FLOAT = 5126;
const ANIMATED = {
  translation: 'VEC3',
  rotation: 'VEC4',
  scale: 'VEC3',
  weights: 'SCALAR'
};

const morph_targets = (gltf, mesh) => gltf.meshes?.[mesh]?.primitives[0].targets?.length ?? 0;

/** Whether a matrix is a product of translation, rotation and scale. */
function is_decomposable(m) {
  const axis = (a) => m.slice(4 * a, 4 * a + 3);
  const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
  return [3, 7, 11].every((i) => m[i] === 0) && m[15] === 1 && [[0, 1], [1, 2], [2, 0]].every(([i, j]) => {
    const a = axis(i), b = axis(j);
    return Math.abs(dot(a, b)) <= SKEW_TOLERANCE * Math.sqrt(dot(a, a) * dot(b, b));
  });
}

function check_nodes(gltf, wrong) {
  const {nodes = [], scenes = []} = gltf;
  const parents = new Map();
  nodes.forEach((node, i) => {
    const place = `/nodes/${i}`, {children = [], matrix, rotation, mesh, skin, weights} = node;
    for (const child of children) {
      if (parents.has(child)) wrong(`${place}/children`, `node ${child} has two parents`);
      parents.set(child, i);
    }
    if (matrix && ['translation', 'rotation', 'scale'].some((name) => node[name]))
      wrong(`${place}/matrix`, 'stands beside translation, rotation or scale');
    if (matrix && !is_decomposable(matrix)) wrong(`${place}/matrix`, 'cannot be decomposed');
    if (rotation && Math.abs(Math.hypot(...rotation) - 1) > QUATERNION_TOLERANCE)
      wrong(`${place}/rotation`, 'is no unit quaternion');
    for (const name of ['skin', 'weights'])
      if (node[name] !== undefined && mesh === undefined) wrong(`${place}/${name}`, 'stands without mesh');
    if (mesh === undefined) return;
    if (weights && weights.length !== morph_targets(gltf, mesh))
      wrong(`${place}/weights`, 'as many as morph targets are due');
    if (
      skin !== undefined &&
      gltf.meshes[mesh].primitives.some(({attributes}) => attributes.JOINTS_0 === undefined))
      wrong(`${place}/skin`, 'the mesh has no joints');
  });
  nodes.forEach((_, i) => {
    let node = parents.get(i);
    for (let steps = 0; node !== undefined && node !== i && steps < nodes.length; ++steps)
      node = parents.get(node);
    if (node === i) wrong(`/nodes/${i}`, 'is its own ancestor');
  });
  scenes.forEach((scene, i) => scene.nodes?.forEach((node, n) => {
    if (parents.has(node)) wrong(`/scenes/${i}/nodes/${n}`, `node ${node} has a parent`);
  }));
}

function check_cameras({cameras = []}, wrong) {
  cameras.forEach(({perspective, orthographic}, i) => {
    const place = `/cameras/${i}`, lens = perspective ?? orthographic;
    if ((perspective === undefined) === (orthographic === undefined))
      return wrong(place, 'needs either perspective or orthographic');
    if (lens.zfar <= lens.znear) wrong(place, 'zfar is not greater than znear');
    if (orthographic && (lens.xmag === 0 || lens.ymag === 0))
      wrong(`${place}/orthographic`, 'a magnification of 0');
  });
}

function check_skins({skins = [], accessors}, wrong) {
  skins.forEach(({inverseBindMatrices, joints}, i) => {
    const matrices = accessors?.[inverseBindMatrices], place = `/skins/${i}/inverseBindMatrices`;
    if (!matrices) return;
    if (matrices.type !== 'MAT4' || matrices.componentType !== FLOAT) wrong(place, 'are not MAT4 of floats');
    if (matrices.count < joints.length) wrong(place, 'are fewer than the joints');
  });
}

function check_animation(gltf, {samplers, channels}, place, report) {
  const wrong = (at, message) => report('GLTF_MALFORMED', at, message);
  samplers.forEach(({input, interpolation}, s) => {
    const times = gltf.accessors[input], at = `${place}/samplers/${s}/input`;
    if (times.type !== 'SCALAR' || times.componentType !== FLOAT) wrong(at, 'times are SCALAR floats');
    if (!times.min || !times.max) wrong(at, 'times need min and max');
    if (interpolation === 'CUBICSPLINE' && times.count < 2) wrong(at, 'a cubic spline needs two times');
  });
  const seen = new Set();
  channels.forEach(({sampler, target: {node, path}}, c) => {
    const at = `${place}/channels/${c}`;
    if (sampler >= samplers.length)
      return report('GLTF_ACCESSOR', `${at}/sampler`, 'there is no such sampler');
    if (node !== undefined && seen.size === seen.add(`${node} ${path}`).size)
      wrong(`${at}/target`, 'is the target of another channel, too');
    if (gltf.nodes?.[node]?.matrix) wrong(`${at}/target`, 'the node has a matrix');
    const {input, output, interpolation} = samplers[sampler], values = gltf.accessors[output];
    if (!ANIMATED[path]) return;
    const integers = (path === 'rotation' || path === 'weights') && values.normalized;
    if (values.type !== ANIMATED[path] || (values.componentType !== FLOAT && !integers))
      wrong(`${at}/sampler`, `the output is no format for ${path}`);
    const each = (interpolation === 'CUBICSPLINE' ? 3 : 1) *
      (path === 'weights' ? morph_targets(gltf, gltf.nodes?.[node]?.mesh) : 1);
    if (values.count !== gltf.accessors[input].count * each)
      wrong(`${at}/sampler`, 'the output has another count');
  });
}

export function check_hierarchy(gltf, report) {
  const wrong = (place, message) => report('GLTF_MALFORMED', place, message);
  check_nodes(gltf, wrong);
  check_cameras(gltf, wrong);
  check_skins(gltf, wrong);
  (gltf.animations ?? [])
    .forEach((animation, i) => check_animation(gltf, animation, `/animations/${i}`, report));
}
