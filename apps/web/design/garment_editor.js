// The garment that the page shows. The program puts the cloth on it, by the command that the page shows, on files in memory.
import {Color} from 'three';
import {file_name} from './recipe.js';

const LARGEST = 128e6, EXTENSION = 'SELVEDGE_materials_fabric';
const number = (x) => String(Number(x.toPrecision(3)));

export class GarmentEditor {
  /** Its file's name; null: the page's own one. */
  file_name = null;
  /** Its materials: { index, name, wears, about }; what `dress` says of each, and of all in `remarks`. */
  parts = [];
  remarks = [];
  #bytes = null;
  /** What the user wants otherwise than --all: by the numbers of materials, whether they wear the cloth. */
  #choices = new Map();
  /** `view`: the page's. `dresser`: a Maker. */
  constructor(view, dresser) {
    Object.assign(this, {view, dresser, stage: view.stage});
    this.#take_parts({});
  }
  get name() {
    return this.file_name?.replace(/\.glb$/i, '') ?? 'garment';
  }
  /** The words of `selvedge` that dress it in the file of its cloth. */
  words() {
    const choices = [...this.#choices].flatMap(([index, wears]) => [wears ? '--material' : '--except', `#${index}`]);
    const colour = this.stage.tint_colour ? ['--colour', `#${new Color(...this.stage.tint_colour).getHexString()}`] : [];
    return ['dress', this.file_name ?? 'garment.glb', `${file_name()}.fabric.exr`, '--all', ...choices, ...colour, '-o', `${this.name}.${file_name()}.glb`];
  }
  #take_parts({materials, warnings = []}) {
    const {json} = this.stage.garments[0].parser, worn = new Map(materials?.map((each) => [each.index, each]));
    const parts = (json.materials ?? []).map(({name, extensions}, index) => {
      const dressed = worn.get(index), wears = materials ? Boolean(dressed) : Boolean(extensions?.[EXTENSION]);
      const [left] = warnings.flatMap((line) => line.match(new RegExp(`^material #${index} .* was left alone: (.*); --material`))?.[1] ?? []);
      const kept = dressed?.kept.length > 0 ? `, keeps ${dressed.kept.join(', ')}` : '';
      return {index, name: name ?? `#${index}`, wears, about: dressed ? `${dressed.repeats.map(number).join(' x ')} repeats${kept}` : left ?? ''};
    });
    Object.assign(this, {parts, remarks: warnings.filter((line) => !/ was left alone: /.test(line))});
    if (parts.some(({wears}) => !wears)) this.view.reflect();
  }
  /** Runs `dress` on the garment; its file and report. Throws an Error of one line. */
  async #dress(cloth) {
    const bytes = this.#bytes ??= new Uint8Array(await this.view.bytes_of(this.stage.garments[0].element)), argv = this.words();
    const {files, out, err, refusal} = await this.dresser.ask({argv: [...argv, '--json'], files: new Map([[argv[1], bytes], [argv[2], cloth]])});
    const {error, ...report} = out ? JSON.parse(out) : {error: {message: refusal ?? err.trim()}};
    if (error) throw new Error([error.place, error.message].filter(Boolean).join(': ') + (error.code ? ` [${error.code}]` : ''));
    return {bytes: files.get(argv.at(-1)), report};
  }
  async #show(cloth) {
    const {bytes, report} = await this.#dress(cloth), {view, stage} = this;
    const {scene, parser} = await view.loader.parseAsync(bytes.slice().buffer, '').catch(({message}) => {
      throw new Error(message.replace('THREE.GLTFLoader: ', ''));
    });
    const [before] = stage.garments.splice(0, 1, {scene, parser, dataset: {}}), fabrics = new Set();
    before.scene.traverse(({geometry}) => geometry?.dispose());
    before.floor?.removeFromParent();
    scene.traverse(({material}) => material?.fabric && fabrics.add(material));
    await Promise.all([...fabrics].map(({fabric}) => fabric.settled));
    for (const material of fabrics) {
      const {kept = []} = report.materials.find(({index}) => index === parser.associations.get(material)?.materials) ?? {}, {albedo} = material.fabric;
      if (kept.some((part) => /^tint/.test(part))) material.userData.print = material.parts.tint.map((c, k) => c * albedo[k]);
    }
    this.#take_parts(report);
    if (stage.shown_view === 'swatch') stage.shown_view = 'both';
    stage.show_all();
  }
  /** Does what changes the garment, and shows it in a cloth; throws an Error of one line, and the garment before stays. */
  async #change(cloth, act) {
    const before = [this.file_name, this.#bytes, this.#choices];
    try {
      act();
      await this.#show(cloth);
    } catch (error) {
      [this.file_name, this.#bytes, this.#choices] = before;
      throw error;
    }
  }
  /** Whether a part wears the cloth. */
  set_wears({index}, wears, cloth) {
    return this.#change(cloth, () => this.#choices = new Map(this.#choices).set(index, wears));
  }
  dress_again = (cloth) => this.#change(cloth, () => {});
  /** Takes a garment from a .glb file. */
  async open_file(file, cloth) {
    if (file.size > LARGEST) throw new Error(`has ${Math.round(file.size / 1e6)} MB, this page takes ${LARGEST / 1e6} MB: selvedge dress '${file.name}' dresses it`);
    const bytes = new Uint8Array(await file.arrayBuffer());
    await this.#change(cloth, () => {
      [this.file_name, this.#bytes, this.#choices] = [file.name, bytes, new Map()];
      this.stage.group.clear();
    });
  }
  /** The bytes of the garment in a cloth, a .glb file. */
  dressed_glb = async (cloth) => (await this.#dress(cloth)).bytes;
  /** The bytes of the fabric that the page began with. */
  async first_fabric() {
    const {parser} = this.stage.garments[0], view = parser.json.extensions?.[EXTENSION]?.fabrics?.[0]?.bufferView;
    return view === undefined ? null : new Uint8Array(await parser.getDependency('bufferView', view)).slice();
  }
}
