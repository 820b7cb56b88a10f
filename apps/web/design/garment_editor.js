// The garment that the page shows. The program puts the cloth on it, by the command that the page shows, on files in memory.
import {find_file} from './opened_files.js';
import {file_name, garment_name, worn} from './recipe.js';

const EXTENSION = 'SELVEDGE_materials_fabric', TEMPLATE = new TextEncoder().encode('<!--GARMENTS-->\n');
const number = (x) => String(Number(x.toPrecision(3)));

export class GarmentEditor {
  /** Its materials: { index, name, wears, about }; what `dress` says of each, and of all in `remarks`. */
  parts = [];
  remarks = [];
  /** What is shown, as JSON, and the garment that the page began with. */
  #shown = '{}';
  #first = null;
  /** `view`: the page's. `program`: a Maker. */
  constructor(view, program) {
    Object.assign(this, {view, program, stage: view.stage});
    [this.#first] = this.stage.garments;
    this.#take_parts({});
  }
  /** The words of `selvedge` that dress it in the file of its cloth. */
  words({file = 'garment.glb', choices = {}, tint} = worn) {
    const chosen = Object.entries(choices).flatMap(([index, wears]) => [wears ? '--material' : '--except', `#${index}`]);
    return ['dress', file, `${file_name()}.fabric.exr`, '--all', ...chosen, ...tint ? ['--colour', tint] : [], '-o', `${garment_name()}.${file_name()}.glb`];
  }
  #take_parts({materials, warnings = []}) {
    const {json} = this.stage.garments[0].parser, dressed_by = new Map(materials?.map((each) => [each.index, each]));
    const parts = (json.materials ?? []).map(({name, extensions}, index) => {
      const dressed = dressed_by.get(index), wears = materials ? Boolean(dressed) : Boolean(extensions?.[EXTENSION]);
      const [left] = warnings.flatMap((line) => line.match(new RegExp(`^material #${index} .* was left alone: (.*); --material`))?.[1] ?? []);
      const kept = dressed?.kept.length > 0 ? `, keeps ${dressed.kept.join(', ')}` : '';
      return {index, name: name ?? `#${index}`, wears, about: dressed ? `${dressed.repeats.map(number).join(' x ')} repeats${kept}` : left ?? ''};
    });
    Object.assign(this, {parts, remarks: warnings.filter((line) => !/ was left alone: /.test(line))});
    if (parts.some(({wears}) => !wears)) this.view.reflect();
  }
  /** Runs `dress` on a garment; its file and report. Throws an Error of one line. */
  async #dress(cloth, garment = worn) {
    const bytes = garment.key ? await find_file(garment.key) : new Uint8Array(await this.view.bytes_of(this.#first.element));
    const argv = this.words(garment), {files, report} = await this.program.run_next(argv, {[argv[1]]: bytes, [argv[2]]: cloth});
    return {bytes: files.get(argv.at(-1)), report};
  }
  /** What a garment has to be dressed anew for: the page's own one has its tint by the stage. */
  #wanted({tint, ...garment}) {
    return JSON.stringify(garment.key ? {...garment, tint} : garment);
  }
  shows = (garment) => this.#wanted(garment) === this.#shown;
  /** Shows a garment in a cloth, if it is not shown; throws an Error of one line, and the garment before stays. */
  async show(garment, cloth) {
    const wanted = this.#wanted(garment), {stage, view} = this;
    if (this.shows(garment)) return;
    const is_other = garment.key !== JSON.parse(this.#shown).key;
    let shown = this.#first, report = {};
    if (wanted !== '{}') {
      const dressed = await this.#dress(cloth, garment);
      // The page of `selvedge page` has its frame and its shade on the floor.
      const {files} = await this.program.run_next(['page', 'garment.glb', '-o', 'page.html'], {'garment.glb': dressed.bytes, '//page.html': TEMPLATE});
      const page = new DOMParser().parseFromString(new TextDecoder().decode(files.get('page.html')), 'text/html');
      shown = await view.load_garment(page.querySelector('[data-garment]')).catch(({message}) => {
        throw new Error(message.replace('THREE.GLTFLoader: ', ''));
      });
      ({report} = dressed);
      delete shown.element;
    }
    this.#shown = wanted;
    const [before] = stage.garments.splice(0, 1, shown);
    before.floor?.removeFromParent();
    if (before !== this.#first) view.dispose_garment(before);
    if (shown.floor) stage.group.parent.add(shown.floor);
    const kept_by = new Map(report.materials?.map(({index, kept}) => [index, kept]));
    shown.scene.traverse(({material}) => {
      const kept = material?.fabric && kept_by.get(shown.parser.associations.get(material)?.materials);
      if (kept?.some((part) => /^tint/.test(part))) material.userData.print = material.parts.tint.map((c, k) => c * material.fabric.albedo[k]);
    });
    this.#take_parts(report);
    if (is_other) stage.group.clear();
    if (stage.shown_view === 'swatch') stage.shown_view = 'both';
    stage.show_all();
  }
  /** The bytes of the garment in a cloth, a .glb file. */
  dressed_glb = async (cloth) => (await this.#dress(cloth)).bytes;
  /** The bytes of the fabric that the page began with. */
  async first_fabric() {
    const {parser} = this.#first, view = parser.json.extensions?.[EXTENSION]?.fabrics?.[0]?.bufferView;
    return view === undefined ? null : new Uint8Array(await parser.getDependency('bufferView', view)).slice();
  }
}
