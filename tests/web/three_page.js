// In the browser: facts about fabrics in three.js, each told in a line; they throw where they do not hold.
import {
  AmbientLight, BatchedMesh, Bone, BoxGeometry, BufferAttribute, BufferGeometry, CanvasTexture, Color, CubeTexture, DataTexture, DataUtils, DirectionalLight, DoubleSide, EquirectangularReflectionMapping,
  Euler, Float32BufferAttribute, FloatType, Group, HalfFloatType, HemisphereLight, InstancedMesh, LightProbe, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  MeshPhysicalMaterial, PerspectiveCamera, PointLight, REVISION, RGBAFormat, RectAreaLight, SRGBColorSpace, Scene, Skeleton, SkinnedMesh, SphereGeometry, SpotLight, Uint16BufferAttribute, Vector3,
} from 'three';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { clone } from 'three/addons/utils/SkeletonUtils.js';
import * as way from 'way';
import { garment_of } from '/test/garment.mjs';

/** 3 x 2 texels of lobes, frames and a table: no direction looks like another. */
const MATT = '/kit/lobes-0.exr', CLOTH = '/kit/layers-lobes-frame-table.exr', OTHER = '/kit/light-lobes.exr', OPEN = '/kit/layers-lobes-opacity.exr';
const YARN = '/kit/yarns-flat.exr', SIZE = 32;
/** Images are halves. */
const HALF = 2 ** -10;

const { FabricMaterial, LoadedFabric, PMREMGenerator, RenderTarget, SelvedgeFabric, Surroundings, cell_images, plain_lay, read, renderer_of, restore, use_memory } = way;
const main_renderer = await renderer_of();
// SwiftShader's WebGPU ends where it draws on a canvas without a window.
main_renderer.setRenderTarget(new RenderTarget(SIZE, SIZE));

function need(holds, what) {
  if (!holds) throw new Error(what);
}
async function material_of({ lay = plain_lay, file = CLOTH, keeps_opacity = false } = {}) {
  const fabric = new LoadedFabric({ url: new URL(file, location).href }, file);
  await fabric.settled;
  return new FabricMaterial({ fabric, lay, keeps_opacity });
}
/** Quads that lie at z = 0 one beside the other, v downwards as in glTF; the first has its middle at 0. */
function cloth(quads = 1, side = 1) {
  const geometry = new BufferGeometry(), corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
  const all = Array.from({ length: quads }, (_, i) => corners.map(([x, y]) => [x + i, y])).flat();
  const set = (name, values, size) => geometry.setAttribute(name, new Float32BufferAttribute(values.flat(), size));
  set('position', all.map(([x, y]) => [side * x, side * y, 0]), 3);
  set('normal', all.map(() => [0, 0, 1]), 3);
  set('uv', all.map(([x, y]) => [x + 0.5, 0.5 - y]), 2);
  geometry.setIndex(Array.from({ length: quads }, (_, i) => [0, 1, 2, 0, 2, 3].map((k) => 4 * i + k)).flat());
  return geometry;
}
function camera_at(x, y, z) {
  const camera = new PerspectiveCamera(30, 1, 0.1, 100);
  camera.position.set(x, y, z);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  return camera;
}
const CAMERA = camera_at(0.7, -0.6, 2);
function light_from(x, y, z) {
  const light = new DirectionalLight(0xffffff, 2);
  light.position.set(x, y, z);
  return light;
}

/** Red, green, blue and alpha of each pixel, row by row from below; `around`: members of the scene. */
async function picture(objects, camera = CAMERA, around = {}, renderer = main_renderer, size = SIZE) {
  const scene = Object.assign(new Scene(), around).add(...objects);
  const target = new RenderTarget(size, size, { type: FloatType });
  renderer.setRenderTarget(target);
  renderer.render(scene, camera);
  const materials = [];
  scene.traverse(({ material }) => material?.isFabricMaterial && materials.push(material));
  const is_ready = () => materials.every(({ shows }) => shows === 'fabric') && cell_images.at_rest();
  for (const end = performance.now() + 20000; !is_ready();) {
    need(performance.now() < end, 'the images do not come');
    need(!cell_images.at_rest(), 'at rest before all is shown');
    await new Promise((go_on) => setTimeout(go_on, 20));
    renderer.render(scene, camera);
  }
  // Nodes draw shadow maps once an animation's frame, and the last picture's may be of this one.
  for (let k = 0; k < 2; ++k) await new Promise(requestAnimationFrame);
  renderer.render(scene, camera);
  const pixels = await read(renderer, target);
  target.dispose();
  return pixels;
}
const largest = (pixels) => pixels.reduce((a, b) => Math.max(a, b), 0);
/** How many pixels of two pictures differ by more than a thousandth of the brightest. */
function differences(a, b) {
  const bound = 1e-3 * largest(a);
  let count = 0;
  for (let i = 0; i < a.length; i += 4) count += [0, 1, 2, 3].some((k) => Math.abs(a[i + k] - b[i + k]) > bound);
  need(bound > 0, 'nothing is seen');
  return count;
}
/** Two pictures are one but for a pixel or two at edges, where rounding decides. */
function need_same(a, b, what) {
  const count = differences(a, b);
  need(count <= 2, `${what}: ${count} pixels differ`);
  return `${count} of ${SIZE * SIZE} pixels differ`;
}
/** How alike two pictures are, dB to the brightest. */
function need_alike(a, b, least, what) {
  const mean = a.reduce((sum, x, i) => sum + (x - b[i]) ** 2, 0) / a.length, db = 10 * Math.log10(largest(a) ** 2 / mean);
  need(db >= least, `${what}: ${db} dB`);
  return `${db.toFixed(1)} dB`;
}
/** The points of z = 0 that the pixels of CAMERA show. */
const points = () => Array.from({ length: SIZE * SIZE }, (_, i) => {
  const x = i % SIZE + 0.5, y = Math.floor(i / SIZE) + 0.5;
  const way = new Vector3(2 * x / SIZE - 1, 2 * y / SIZE - 1, 0.5).unproject(CAMERA).sub(CAMERA.position);
  return CAMERA.position.clone().addScaledVector(way, -CAMERA.position.z / way.z);
});

function lights() {
  const point = new PointLight(new Color(1, 0.5, 0.25), 3, 4, 1.5), spot = new SpotLight(0xffffff, 5, 0, 0.5, 0.6, 2);
  point.position.set(-0.3, 0.4, 0.8);
  spot.position.set(0.6, 0.3, 1.5);
  return { directional: light_from(0.5, 0.7, 1), point, spot };
}

/** An environment that is nowhere the same, with a bright part. */
function environment_of(type, flipY) {
  const width = 64, height = 32, halves = type === HalfFloatType;
  const data = new (halves ? Uint16Array : Float32Array)(4 * width * height);
  for (let i = 0; i < width * height; ++i) {
    const x = i % width / width, row = Math.floor(i / width), y = (flipY ? row + 0.5 : height - 0.5 - row) / height;
    const bright = Math.hypot(x - 0.8, y - 0.4) < 0.04 ? 40 : 1;
    [bright * (1 - y), bright * x, 0.5, 1].forEach((value, c) => {
      data[4 * i + c] = halves ? DataUtils.toHalfFloat(value) : value;
    });
  }
  const texture = new DataTexture(data, width, height, RGBAFormat, type, EquirectangularReflectionMapping);
  texture.flipY = flipY;
  texture.needsUpdate = true;
  return texture;
}

/** A canvas of a colour with a brighter part. */
function canvas_of(colour, width, height) {
  const canvas = Object.assign(document.createElement('canvas'), { width, height }), context = canvas.getContext('2d');
  for (const [style, ...place] of [[colour, 0, 0, width, height], ['#ffd', width / 4, height / 8, width / 4, height / 4]]) {
    context.fillStyle = style;
    context.fillRect(...place);
  }
  return canvas;
}
/** What lights a scene from all around: members of it, or lights. */
function soft_lights() {
  const generator = new PMREMGenerator(main_renderer), probe = new LightProbe();
  probe.sh.coefficients.forEach((c, k) => c.set(2, 1.5, 1).multiplyScalar(k === 0 ? 1 : 0.1 * (k % 3 - 1)));
  const ldr = new CanvasTexture(canvas_of('#456', 128, 64)), sides = ['#a00', '#0a0', '#47c', '#432', '#888', '#aa0'];
  const cube = new CubeTexture(sides.map((colour) => canvas_of(colour, 64, 64))), rectangle = new RectAreaLight(0xffffff, 4, 2, 3);
  Object.assign(ldr, { mapping: EquirectangularReflectionMapping, colorSpace: SRGBColorSpace });
  Object.assign(cube, { colorSpace: SRGBColorSpace, needsUpdate: true });
  rectangle.position.set(1, 1.5, 2);
  rectangle.lookAt(0, 0, 0);
  const hemisphere = new HemisphereLight(0xaaccff, 0x332211, 3);
  hemisphere.position.set(1, 2, 1);
  return {
    room: { environment: generator.fromScene(new RoomEnvironment(), 0.04).texture },
    'an environment, made ready': { environment: generator.fromEquirectangular(environment_of(HalfFloatType, false)).texture },
    environment: { environment: environment_of(HalfFloatType, false) }, 'a picture': { environment: ldr }, cube: { environment: cube },
    ambient: new AmbientLight(0xffeedd, 2), hemisphere, probe, rectangle,
  };
}

/** Shows a variant as three.js's example does. */
async function show_variant(scene, parser, index) {
  for (const object of scene.children) {
    const { mappings } = object.userData.gltfExtensions.KHR_materials_variants;
    const { material } = mappings.find(({ variants }) => variants.includes(index));
    object.material = await parser.getDependency('material', material);
    parser.assignFinalMaterial(object);
    await object.material.fabric.settled;
  }
}
async function load(text) {
  const loader = new GLTFLoader();
  loader.register((parser) => new SelvedgeFabric(parser));
  const gltf = await loader.parseAsync(text, `${location.origin}/`);
  const materials = [];
  gltf.scene.traverse(({ material }) => material && materials.push(material));
  for (const { fabric } of materials) await fabric.settled;
  return gltf;
}
/** Two quads that have a bone each; the second's lies at its left edge. */
function skinned_cloth(material) {
  const geometry = cloth(2), bones = [new Bone(), new Bone()], mesh = new SkinnedMesh(geometry, material);
  const of_quad = (i) => Array(4).fill([i, 0, 0, 0]).flat();
  geometry.setAttribute('skinIndex', new Uint16BufferAttribute([...of_quad(0), ...of_quad(1)], 4));
  geometry.setAttribute('skinWeight', new Float32BufferAttribute([...of_quad(1), ...of_quad(1)], 4));
  bones[0].add(bones[1]);
  bones[1].position.x = 0.5;
  mesh.add(bones[0]);
  mesh.bind(new Skeleton(bones));
  return { mesh, bones };
}
const SUN = () => light_from(0.5, 0.7, 1);

export const facts = {
  'directional, point and spot lights give matt cloth what they give a matt material of three.js': async () => {
    const material = await material_of({ file: MATT }), told = [];
    material.level = 1;  // one texel, of one colour
    const seen = (matt, light) => picture([new Mesh(cloth(1, 10), matt), light]);
    let albedo;
    for (const [name, light] of Object.entries(lights())) {
      const cloths = await seen(material, light), whites = await seen(new MeshLambertMaterial(), light), most = largest(whites);
      const at = whites.findIndex((x) => x > most / 2) >> 2;
      albedo ??= [0, 1, 2].map((c) => cloths[4 * at + c] / whites[4 * at + c]);
      const worst = whites.reduce((worst, x, i) => i % 4 < 3 ? Math.max(worst, Math.abs(cloths[i] - x * albedo[i % 4]) / most) : worst, 0);
      told.push(`${name} ${worst}`);
      need(largest(albedo) > 0 && worst < HALF, told.join(', '));
    }
    return told.join(', ');
  },

  'what lights a matt material of three.js from all around lights matt cloth': async () => {
    const material = await material_of({ file: MATT, lay: { ...plain_lay, scale: [48, 24] } }), geometry = new SphereGeometry(0.5, 48, 24), told = [];
    material.level = 1;
    const matt = new MeshPhysicalMaterial({ roughness: 1, specularIntensity: 0 });
    const seen = async (of, light) => {
      const pixels = await picture([new Mesh(geometry, of), ...light.isLight ? [light] : []], CAMERA, light.isLight ? {} : light);
      return [0, 1, 2].map((c) => pixels.reduce((sum, x, i) => sum + (i % 4 === c ? x : 0), 0));
    };
    const ratios = async (light) => {
      const cloths = await seen(material, light), matts = await seen(matt, light);
      return cloths.map((x, c) => x / matts[c]);
    };
    // The irradiance that three.js before 0.184 finds of an environment is a blurred picture.
    const of_directional = await ratios(SUN()), of_exact_mips = Number.parseInt(REVISION, 10) >= 184;
    for (const [name, light] of Object.entries(soft_lights())) {
      const fractions = (await ratios(light)).map((x, c) => x / of_directional[c]), off = light.isLight || of_exact_mips ? 0.04 : 0.1;
      told.push(`${name} ${fractions.map((x) => x.toFixed(3))}`);
      need(fractions.every((x) => Math.abs(x - 1) < off), told.join(', '));
    }
    if (!Surroundings) return told.join(', ');
    // Ambient light comes beside the light that surroundings leave each vertex.
    const ball = new Mesh(geometry, material), scene = new Scene(), around = new Surroundings(scene, { width: 64, height: 32, radiance: new Float32Array(6144).fill(0.3) });
    const sum_of = async (members, ...lights) => (await picture([ball, ...lights], CAMERA, members)).reduce((sum, x, i) => sum + (i % 4 < 3 ? x : 0), 0);
    around.stand(ball);
    await around.shade(main_renderer, ball);
    const { environment, environmentRotation, environmentIntensity } = scene, of_scene = { environment, environmentRotation, environmentIntensity };
    const [one, other, both] = [await sum_of(of_scene), await sum_of({}, new AmbientLight(0xffffff, 1)), await sum_of(of_scene, new AmbientLight(0xffffff, 1))];
    need(one > 0 && other > 0 && Math.abs(both / (one + other) - 1) < 0.01, `surroundings ${one}, ambient ${other}, both ${both}`);
    return told.join(', ');
  },

  'shadow maps darken what lies behind a blocker, and nothing else': async () => {
    const material = await material_of(), half = 0.15, height = 0.4, edge = 0.03, told = [];
    for (const [name, light] of Object.entries(lights())) {
      light.castShadow = true;
      light.shadow.mapSize.set(1024, 1024);
      light.shadow.camera.near = 0.1;
      const ground = new Mesh(cloth(1, 10), material);
      const blocker = new Mesh(
        new BoxGeometry(2 * half, 2 * half, 1e-3), new MeshBasicMaterial({ colorWrite: false, depthWrite: false }));
      ground.receiveShadow = blocker.castShadow = true;
      blocker.position.z = height;
      const free = await picture([ground, light]), shaded = await picture([ground, blocker, light]);
      let dark = 0, lit = 0;
      points().forEach((point, i) => {
        const way = light.isDirectionalLight ? light.position : light.position.clone().sub(point);
        const through = point.clone().addScaledVector(way, height / way.z);
        const off = Math.max(Math.abs(through.x), Math.abs(through.y)) - half;
        if (Math.abs(off) < edge || !(free[4 * i] > 0)) return;
        const fraction = shaded[4 * i] / free[4 * i];
        need(Math.abs(fraction - (off < 0 ? 0 : 1)) < 1e-5, `${name}: ${fraction} of the light ${off} beside the blocker`);
        off < 0 ? ++dark : ++lit;
      });
      need(dark > 10 && lit > 100, `${name}: ${dark} dark, ${lit} lit`);
      told.push(`${name} ${dark} dark, ${lit} lit`);
    }
    return told.join('; ');
  },

  'an environment lights a cloth, of the scene or of its material, in floats or halves, from either end': async () => {
    const mesh = new Mesh(cloth(), await material_of()), { material } = mesh;
    const seen = (around) => picture([mesh], CAMERA, around);
    const whole = await seen({ environment: environment_of(FloatType, false) });
    const turned = await seen({ environment: environment_of(FloatType, false), environmentRotation: new Euler(0, 1, 0) });
    need(differences(whole, turned) > 50, 'it does not turn');
    const told = [need_same(whole, await seen({ environment: environment_of(HalfFloatType, true) }), 'halves')];
    const half = await seen({ environment: environment_of(HalfFloatType, true), environmentIntensity: 0.5 });
    told.push(need_same(whole, half.map((x, i) => i % 4 < 3 ? 2 * x : x), 'half of it'));
    material.envMap = environment_of(HalfFloatType, false);
    material.envMapIntensity = 0.5;
    material.envMapRotation = new Euler(0, 1, 0);
    told.push(need_same(turned, (await seen()).map((x, i) => i % 4 < 3 ? 2 * x : x), 'its own'));
    return told.join('; ');
  },

  'a skinned cloth in motion is the cloth of its pose': async () => {
    const material = await material_of(), { mesh, bones } = skinned_cloth(material);
    material.side = DoubleSide;
    const told = [], pictures = [];
    for (const turn of [0.3, 0.8, -0.7]) {
      bones[1].rotation.set(turn / 2, turn, turn);
      const skinned = await picture([mesh, SUN()]);
      // The second quad turns about the left edge that it has, as a cloth of its own.
      const still = new Mesh(cloth(), material), turned = new Mesh(cloth().translate(0.5, 0, 0), material);
      turned.position.x = 0.5;
      turned.rotation.copy(bones[1].rotation);
      told.push(need_same(skinned, await picture([still, turned, SUN()]), `turned by ${turn}`));
      pictures.push(skinned);
    }
    need(differences(pictures[0], pictures[1]) > 50, 'nothing moves');
    return told.join('; ');
  },

  'layers of several meshes show through holes in their order': async () => {
    const material = await material_of({ file: OPEN, keeps_opacity: true });
    const at = (...depths) => {
      const geometry = cloth(depths.length), { position } = geometry.attributes;
      for (let i = 0; i < position.count; ++i) position.setXYZ(i, position.getX(i % 4), position.getY(i % 4), depths[i >> 2]);
      return new Mesh(geometry, material);
    };
    const whole = await picture([at(-0.6, -0.2, 0.2, 0.6), SUN()]), told = [];
    for (const parts of [[[-0.6, 0.2], [-0.2, 0.6]], [[-0.2, 0.2], [-0.6, 0.6]], [[-0.6, 0.6], [-0.2], [0.2]]])
      told.push(need_same(await picture([...parts.map((depths) => at(...depths)), SUN()]), whole, parts.join(' and ')));
    need(differences(whole, await picture([at(-0.6), SUN()])) > 50, 'one layer looks like four');
    return told.join('; ');
  },

  'a morphed cloth is the cloth of its shape': async () => {
    const material = await material_of(), geometry = cloth(), shaped = cloth();
    shaped.applyMatrix4(new Matrix4().set(1, 0.6, 0, 0, 0.2, 0.9, 0, 0, 0.5, 0.1, 1, 0.1, 0, 0, 0, 1));
    const moved = (name) => {
      const [from, to] = [geometry, shaped].map(({ attributes }) => attributes[name].array);
      return [new BufferAttribute(to.map((x, i) => x - from[i]), 3)];
    };
    geometry.morphAttributes = { position: moved('position'), normal: moved('normal') };
    geometry.morphTargetsRelative = true;
    const mesh = new Mesh(geometry, material);
    const flat = await picture([mesh, SUN()]);
    mesh.morphTargetInfluences[0] = 1;
    const morphed = await picture([mesh, SUN()]);
    need(differences(flat, morphed) > 50, 'nothing moves');
    return need_same(morphed, await picture([new Mesh(shaped, material), SUN()]), 'morphed');
  },

  'instances have the images of the nearest one, and light of their own; none is black': async () => {
    const material = await material_of(), geometry = cloth(1, 0.4), told = [];
    material.side = DoubleSide;
    const many = new InstancedMesh(geometry, material, 3), single = new Group();
    for (let i = 0; i < 3; ++i) {
      const mesh = new Mesh(geometry, material);
      mesh.position.set(0.4 * (1 - i), 0.2 - 0.2 * i, 0.2 - 0.1 * i);
      mesh.rotation.set(0.2 * i, -0.3 * i, 0.5 * i);
      mesh.scale.setScalar(1 - 0.2 * i);
      mesh.updateMatrix();
      many.setMatrixAt(2 - i, mesh.matrix);
      single.add(mesh);
    }
    told.push(need_alike(await picture([many, SUN()]), await picture([single, SUN()]), 30, 'instanced'));
    // The nearest one shows its back, away from the light.
    single.children[0].rotation.y += Math.PI;
    single.children[0].updateMatrix();
    many.setMatrixAt(2, single.children[0].matrix);
    many.instanceMatrix.needsUpdate = true;
    const sum = (pixels) => pixels.reduce((a, b, i) => a + (i % 4 < 3 ? b : 0), 0), fraction = sum(await picture([many, SUN()])) / sum(await picture([single, SUN()]));
    need(Math.abs(fraction - 1) < 0.15, `turned away: ${fraction}`);
    return [...told, fraction].join(', ');
  },

  'clones of a skin, a cloth without normals and a colour are what they stand for': async () => {
    const { mesh, bones } = skinned_cloth(await material_of()), group = new Group().add(mesh), told = [];
    mesh.material.side = DoubleSide;
    bones[1].rotation.set(0.2, 0.3, 0.3);
    const one = await picture([group, SUN()]), copy = clone(group);
    await picture([group, copy.translateY(1), SUN()]);
    group.removeFromParent();
    told.push(need_same(one, await picture([copy.translateY(-1), SUN()]), 'clone'));
    const bare = cloth(), plain = new Mesh(cloth(), await material_of());
    bare.deleteAttribute('normal');
    const flat = new Mesh(bare, plain.material.clone());
    flat.material.flatShading = true;
    const white = await picture([plain, SUN()]);
    told.push(need_same(white, await picture([flat, SUN()]), 'flat'));
    need(await flat.material.ready === 'fabric', 'it is not ready');
    flat.material.color.setRGB(0.5, 0.25, 1);
    told.push(need_same(white.map((x, i) => x * [0.5, 0.25, 1, 1][i % 4]), await picture([flat, SUN()]), 'colour'));
    // three.js's Fox: a skin without corners that triangles share, without normals.
    const fox = skinned_cloth(mesh.material.clone()), parts = fox.mesh.geometry.toNonIndexed();
    parts.deleteAttribute('normal');
    fox.mesh.geometry = parts;
    fox.bones[1].rotation.copy(bones[1].rotation);
    fox.mesh.material.flatShading = true;
    told.push(need_alike(one, await picture([fox.mesh, SUN()]), 40, 'skin'));
    return told.join('; ');
  },

  'meshes that cannot have fabrics say so once, by name': async () => {
    const { warn } = console, told = [], geometry = cloth(), bare = new Mesh(geometry, await material_of()), many = new BatchedMesh(1, 4, 6, await material_of());
    many.addInstance(many.addGeometry(cloth()));
    geometry.deleteAttribute('uv');
    Object.assign(bare, { name: 'sleeve' });
    Object.assign(many, { name: 'crowd' });
    console.warn = (text) => told.push(text);
    for (let i = 0; i < 3; ++i) main_renderer.render(new Scene().add(bare, many), CAMERA);
    console.warn = warn;
    for (const { material } of [bare, many]) need(await material.ready === 'fallback', 'it waits');
    need(told.length === 2 && ['sleeve: GARMENT_NO_UVS', 'crowd: '].every((text) => told.join().includes(text)), told.join());
    return told.join(', ');
  },

  'variants show their fabrics, and lie as these do': async () => {
    const turned = { index: 1, extensions: { KHR_texture_transform: { rotation: 0.7, scale: [2, 1.5] } } };
    const references = [{ index: 0 }, turned, { index: 0, texCoord: 1 }], fabrics = [CLOTH, OTHER];
    const { scene, parser } = await load(garment_of(fabrics, { references, variants: true })), seen = [];
    for (const [i, reference] of [...references, references[0]].entries()) {
      await show_variant(scene, parser, i % 3);
      seen.push(await picture([scene, SUN()]));
      const own = await load(garment_of(fabrics, { references: [reference] }));
      need_same(seen[i], await picture([own.scene, SUN()]), `variant ${i}`);
    }
    need(differences(seen[0], seen[1]) > 50 && differences(seen[0], seen[2]) > 50, 'variants look alike');
    return `${seen.length} switches`;
  },

  'a fabric that is replaced before the worker knows a cloth in it is the other one': async () => {
    const material = await material_of(), [other, again] = await Promise.all([OPEN, OPEN].map((file) => material_of({ file })));
    const drawn = picture([new Mesh(cloth(), material), SUN()]);
    cell_images.replace(material.fabric, other.fabric);
    const replaced = await drawn;
    need(cell_images.shows(material.fabric), 'the first one is awaited');
    return need_same(replaced, await picture([new Mesh(cloth(), again), SUN()]), 'replaced');
  },
  'set 1 with a transform is the cloth with these coordinates': async () => {
    const offset = [0.3, -0.2], rotation = 0.6, scale = [0.8, 1.7];
    const reference = { index: 0, extensions: { KHR_texture_transform: { texCoord: 1, offset, rotation, scale } } };
    const { scene } = await load(garment_of([CLOTH], { references: [reference] }));
    // The formula of the extension's page, in JavaScript.
    const geometry = cloth(), { position, uv } = geometry.attributes, c = Math.cos(rotation), s = Math.sin(rotation);
    for (let i = 0; i < 4; ++i) {
      const u = scale[0] * (3 * position.getY(i) + 0.1), v = scale[1] * (3 * position.getX(i) + 0.2);
      uv.setXY(i, c * u + s * v + offset[0], c * v - s * u + offset[1]);
    }
    return need_same(await picture([scene, SUN()]), await picture([new Mesh(geometry, await material_of()), SUN()]), 'set 1');
  },

  'a second renderer, and what comes after lost graphics, show the same': async () => {
    const mesh = new Mesh(cloth(), await material_of()), one = await picture([mesh, SUN()]), second = await renderer_of();
    const told = [need_same(one, await picture([mesh, SUN()], CAMERA, {}, second), 'second')];
    told.push(need_same(one, await picture([mesh, SUN()], CAMERA, {}, await restore(second)), 'restored'));
    told.push(need_same(one, await picture([mesh, SUN()]), 'first'));
    return told.join('; ');
  },

  'another camera, as of a mirror, leaves the images to the first one': async () => {
    const mesh = new Mesh(cloth(), await material_of()), other = CAMERA.clone(), mirror = new RenderTarget(SIZE, SIZE);
    other.position.x += 0.3;
    const onBeforeRender = (renderer, scene, camera, target) => {
      if (camera === other) return;
      renderer.setRenderTarget(mirror);
      renderer.render(scene, other);
      renderer.setRenderTarget(target);
    };
    const one = await picture([mesh, SUN()]);
    return need_same(one, await picture([mesh, SUN()], CAMERA, { onBeforeRender }), 'mirror');
  },

  'textures and geometries are gone with their objects': async () => {
    const { memory } = main_renderer.info;
    await picture([new Mesh(cloth(), await material_of()), SUN()]);
    const before = { ...memory };
    for (let i = 0; i < 20; ++i) {
      const mesh = new Mesh(cloth(), await material_of());
      await picture([mesh, SUN()]);
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    need(memory.geometries === before.geometries && memory.textures <= before.textures + 1, JSON.stringify([before, memory]));
    return `${memory.geometries} geometries, ${memory.textures} textures`;
  },

  'one quad of 200 repeats is the cloth of its parts': async () => {
    const material = await material_of(), whole = cloth(1, 200), parts = 10, geometry = new BufferGeometry();
    for (const [name, size] of [['position', 3], ['normal', 3], ['uv', 2]]) {
      const of = whole.attributes[name], values = [], at = [0, 1, 3].map((i) => Array.from({ length: size }, (_, k) => of.getComponent(i, k)));
      for (let y = 0; y <= parts; ++y)
        for (let x = 0; x <= parts; ++x)
          values.push(...at[0].map((a, k) => a + (at[1][k] - a) * x / parts + (at[2][k] - a) * y / parts));
      geometry.setAttribute(name, new Float32BufferAttribute(values, size));
    }
    const corners = [];
    for (let i = 0; i < parts * parts; ++i) {
      const first = Math.floor(i / parts) * (parts + 1) + i % parts, next = first + parts + 1;
      corners.push(first, first + 1, next + 1, first, next + 1, next);
    }
    geometry.setIndex(corners);
    for (const { attributes: { uv } } of [whole, geometry]) for (let i = 0; i < uv.array.length; ++i) uv.array[i] *= 200;
    return need_alike(await picture([new Mesh(whole, material), SUN()]), await picture([new Mesh(geometry, material), SUN()]), 45, 'whole');
  },

  'a place that is no number shows the fallback, and says so': async () => {
    const material = await material_of(), geometry = cloth(), { warn } = console, told = [];
    geometry.attributes.position.setX(0, NaN);
    const mesh = new Mesh(geometry, material);
    mesh.frustumCulled = false;
    console.warn = (text) => told.push(text);
    const scene = new Scene().add(mesh);
    for (let i = 0; i < 20 && told.length === 0; ++i) {
      main_renderer.render(scene, CAMERA);
      await new Promise((go_on) => setTimeout(go_on, 20));
    }
    console.warn = warn;
    need(told.length === 1 && told[0].includes('finite') && material.shows === 'fallback' && cell_images.at_rest(), `${told} ${material.shows}`);
    return told[0];
  },
};

/** Facts about images in 4 MiB, on a page of their own. */
export const of_little_memory = {
  'a cloth that turns does not take the images of one that rests': async () => {
    use_memory(2 ** 22);
    const cloths = [YARN, YARN].map(async (file, i) => {
      const mesh = new Mesh(cloth(1, 0.6), await material_of({ file }));
      mesh.position.x = 0.7 * i - 0.35;
      const { uv } = mesh.geometry.attributes;
      for (let k = 0; k < 8; ++k) uv.array[k] *= 40;
      return mesh;
    });
    const meshes = await Promise.all(cloths);
    const seen = (turn) => {
      meshes[1].rotation.y = turn;
      return picture([...meshes, SUN()], CAMERA, {}, main_renderer, 400);
    };
    const first = await seen(0);
    for (let i = 1; i < 60; ++i) await seen(i / 60);
    return need_alike(first, await seen(0), 40, 'turned back');
  },
};
