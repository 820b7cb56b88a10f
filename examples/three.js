// Shows a dressed garment with three.js: await show('sweater.glb', document.body).
import {Box3, DirectionalLight, PerspectiveCamera, Scene, Vector3, WebGLRenderer} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {MeshoptDecoder} from 'three/addons/libs/meshopt_decoder.module.js';
import {SelvedgeFabric, cell_images} from 'selvedge/three';

export async function show(garment, parent) {
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new SelvedgeFabric(parser));
  const model = (await loader.loadAsync(garment)).scene;
  const light = new DirectionalLight(0xffffff, 3);
  light.position.set(1, 2, 3);
  const scene = new Scene().add(model, light);

  const renderer = new WebGLRenderer({antialias: true});
  renderer.setPixelRatio(devicePixelRatio);
  renderer.setSize(parent.clientWidth, parent.clientHeight);
  parent.append(renderer.domElement);
  const camera = new PerspectiveCamera(30, parent.clientWidth / parent.clientHeight, 0.01, 100);
  const controls = new OrbitControls(camera, renderer.domElement);
  const box = new Box3().setFromObject(model), size = box.getSize(new Vector3()).length();
  box.getCenter(controls.target);
  camera.position.copy(controls.target).add(new Vector3(0, 0, 1.5 * size));
  controls.update();

  // A frame when the camera moves, and when the images of the yarn have changed.
  const draw = () => renderer.render(scene, camera);
  controls.addEventListener('change', draw);
  cell_images.addEventListener('change', () => requestAnimationFrame(draw));
  draw();
  return {renderer, scene, draw};
}
