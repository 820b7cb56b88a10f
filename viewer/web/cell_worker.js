// The work of a page's worker: reads fabrics, and makes cell images of patches in sight, in turns. Messages are objects with
// a `kind`. It takes
//
//   start    { wasm, memory }: the module, as bytes or its address; bytes of images
//   fabric   { id, source }; posts fabric { id, result } or { id, issue }
//   garment  { id, fabric, vertices, corners, moves }, of CellModule.add_garment(), `moves` posed()'s `of_mesh` or null; posts garment
//            { id, number, charts, beyond }
//   pose     { garment, influences, bones }: of posed()
//   view     { garment, camera, level, around, lights, serial }: what is seen of a garment from now on
//   remove   { garment }, or { fabric }
//   replace  { fabric, by, edition }: of CellModule.replace_fabric(); garments get their images at once
//   hold     { held }: images wait that are finer than another fabric's first, and of views at rest
//   again    {}: the tiles are lost; the views come again, too
//
// and posts images { garment, first, entries, tiles, missing, wanted, uploads, at_rest, serial, edition }, of CellModule.table()
// and take_uploads(), whether all images are as the view wants them, and which edition of the fabric they show; rows { rows } of the atlas; and end { message }: it can
// do no more.
import {CellModule} from './cells.js';
import {fetch_fabric} from './load.js';
import {posed} from './pose.js';
import {Issue, issue_of} from './reader/issue.js';

/** ms after which messages are taken again, and patches that images are made of without a look at the clock. */
const SLICE = 30, CHUNK = 4;
/** Samples of an image along a pixel's side, and the fraction of images that a frame makes again; of another fabric first larger patches'. */
const SAMPLES = 2, FIRST = 0, MOVING = 0.08, RESTING = 1;
/** Ranks of what is due: after other fabrics and first images come garments that move, then those that rest. */
const MOVES = 2, RESTS = 3;
/** ms without another view after which images are made as one that rests wants them: twice the time between views none of which came to rest. */
const REST = 150, LATEST_REST = 4000;
/** Coordinates beyond are refused, m. */
const FARTHEST = 1e9;
/** ms after which a garment's new images are shown though more are to come. */
const TELL = 120;

/** Repeats of images in a repeat of the cloth: of a map, tiles of so many stitches a side (format/fabric/yarn_map.h). */
const TILE = 64;
const tiles_of = ({layers: {map}}) => map ? map.size.map((stitches) => stitches / TILE) : [1, 1];

export class CellWorker {
  #post;
  #module = null;
  /** What is to be done of each garment: { view, fresh, left }. */
  #due = new Map();
  #views = new Map();
  #working = false;
  #rests_at = 0;
  /** When each garment's images were posted. */
  #told_at = new Map();
  #wake = null;
  #held = false;
  /** Fabrics of garments; editions that they show, and of those that have not all images in front yet. */
  #fabrics = new Map();
  #editions = new Map();
  #coming = new Map();
  /** Whether garments show tiles that are elsewhere now. */
  #has_moved = false;
  /** Vertices of skins and morphs, and how they move. */
  #moves = new Map();
  constructor(post) {
    this.#post = post;
  }

  receive = ({kind, ...message}) => this.#try(() => this[kind](message));
  async #try(work) {
    try {
      await work();
    } catch (error) {
      this.#due.clear();
      this.#post({kind: 'end', message: error.message});
    }
  }
  start({wasm, memory}) {
    this.#module = (async () => {
      const found = typeof wasm === 'string' ? await fetch(wasm) : null;
      if (found?.ok === false) throw new Error(`HTTP ${found.status}`);
      const bytes = found ? await found.arrayBuffer() : wasm;
      const module = new CellModule(await WebAssembly.compile(bytes));
      this.#post({kind: 'rows', rows: module.set_memory(memory)});
      return module;
    })().catch((error) => {
      const remedy = typeof wasm === 'string' ? `${wasm}: ${error.message}; serve cells.wasm there, or give its address to use_worker()` : error.message;
      throw new Issue('GRAPHICS_UNAVAILABLE', '', `WebAssembly: ${remedy}`);
    });
    this.#module.catch(() => {});
  }
  async fabric({id, source}) {
    try {
      const fabric = await fetch_fabric(source), module = await this.#module, number = module.add_fabric(fabric);
      const result = {
        number, levels: fabric.levels, mm_per_repeat: fabric.mmPerRepeat, recipe: fabric.recipe ?? null, sheet: fabric.sheet ?? {},
        accuracy: fabric.accuracy ?? {}, fallback: fabric.fallback ?? {}, albedo: fabric.fallback?.albedo ?? [1, 1, 1], variation: module.variation(number), tiles: tiles_of(fabric),
        has_yarn: Boolean(fabric.layers.yarns), has_holes: module.has_holes
      };
      this.#post({kind: 'fabric', id, result});
    } catch (error) {
      const {code, place, message} = issue_of(error);
      this.#post({kind: 'fabric', id, issue: [code, place, message]});
    }
  }
  async garment({id, fabric, vertices, corners, moves}) {
    const garment = (await this.#module).add_garment(fabric, vertices, corners);
    this.#fabrics.set(garment.number, fabric);
    if (moves) this.#moves.set(garment.number, {vertices, moves});
    this.#post({kind: 'garment', id, ...garment}, [garment.charts.buffer]);
  }
  async pose({garment, influences, bones}) {
    const module = await this.#module, {vertices, moves} = this.#moves.get(garment), shape = posed(vertices, moves, influences, bones);
    if (shape.every((x) => Math.abs(x) < FARTHEST)) module.pose_garment(garment, shape);
  }
  async view({garment, ...view}) {
    await this.#module;
    const now = performance.now(), between = this.#due.has(garment) ? now - this.#views.get(garment).seen_at : Infinity;
    this.#rests_at = now + (between < LATEST_REST ? Math.min(Math.max(REST, 2 * between), LATEST_REST) : REST);
    this.#views.set(garment, {...view, seen_at: now});
    this.#due.set(garment, {view, fresh: this.#told_at.has(garment) ? MOVING : FIRST, left: null});
    this.#wake?.();
    this.#try(() => this.#work());
  }
  async replace({fabric, by, edition}) {
    (await this.#module).replace_fabric(fabric, by);
    for (const [garment, its_fabric] of this.#fabrics) {
      if (its_fabric !== fabric) continue;
      this.#coming.set(garment, edition);
      if (this.#views.has(garment)) this.#due.set(garment, {view: this.#views.get(garment), fresh: FIRST, left: null});
    }
    this.#wake?.();
    this.#try(() => this.#work());
  }
  hold({held}) {
    this.#held = held;
    this.#wake?.();
  }
  async remove({garment, fabric}) {
    const module = await this.#module;
    if (fabric !== undefined) return module.remove_fabric(fabric);
    this.#due.delete(garment);
    this.#views.delete(garment);
    for (const map of [this.#told_at, this.#fabrics, this.#editions, this.#coming, this.#moves]) map.delete(garment);
    module.remove_garment(garment);
  }
  again = async () => (await this.#module).forget_tiles();

  async #work() {
    if (this.#working) return;
    this.#working = true;
    const module = await this.#module;
    while (this.#due.size > 0) {
      const rank = ([garment, {fresh}]) => this.#coming.has(garment) ? 0 : fresh === FIRST ? 1 : fresh < RESTING ? MOVES : RESTS;
      const first = Math.min(...[...this.#due].map(rank)), early = first < RESTS ? 0 : this.#held ? LATEST_REST : this.#rests_at - performance.now();
      if (early > 0) {
        await new Promise((end) => {
          this.#wake = end;
          setTimeout(end, early);
        });
        continue;
      }
      const next = [...this.#due].filter((due) => rank(due) === first);
      // Garments that move take turns: none waits for the end of another one's images, which comes to none.
      this.#make(module, first === MOVES ? next.slice(0, 1) : next);
      await new Promise((end) => setTimeout(end));
    }
    this.#working = false;
  }
  /** Whether garments in sight lack images of the fabric that has taken their own's place. */
  #awaits_any = () => [...this.#coming.keys()].some((garment) => this.#views.has(garment));
  /** Makes images of these garments for a while, those nearest to the middle of the picture first. */
  #make(module, all) {
    const begin = performance.now();
    for (const [garment, due] of all) {
      const {view: {camera, level, around, lights}, fresh} = due;
      // Messages do not wait for many garments at rest.
      if (due.left === null && fresh === RESTING && performance.now() > begin + SLICE) return;
      due.left ??= module.begin_frame(garment, [...camera, SAMPLES, fresh, level, around ? 1 : 0, ...around ?? Array(36).fill(0)], lights);
    }
    const made = new Set(all.filter(([, {left}]) => left === 0)), off_middle = ([garment]) => module.next_off_middle(garment);
    for (const end = performance.now() + SLICE; performance.now() < end;) {
      const next = all.reduce((a, b) => off_middle(b) < off_middle(a) ? b : a), [garment, due] = next;
      if (due.left === 0) break;
      due.left = module.make_images(garment, CHUNK);
      made.add(next);
    }
    const {is_full, has_moved} = module.take_events();
    for (const [garment, {view, fresh, left}] of made) {
      this.#due.delete(garment);
      if (left > 0) this.#due.set(garment, {view, fresh, left});
      else if (fresh !== RESTING) this.#due.set(garment, {view, fresh: RESTING, left: null});
    }
    if (is_full)
      for (const [each, its_view] of this.#views) this.#due.set(each, {view: its_view, fresh: RESTING, left: null});
    this.#show(module, new Map([...made].map(([garment, {left}]) => [garment, left])), has_moved);
  }
  /** Posts what is to be seen; `made`: patches that are left of garments with new images. */
  #show(module, made, has_moved) {
    this.#has_moved ||= has_moved;
    for (const garment of made.keys()) {
      if (!this.#coming.has(garment) || !module.end_front(garment)) continue;
      this.#editions.set(garment, this.#coming.get(garment));
      this.#coming.delete(garment);
      this.#has_moved = true;
    }
    // All garments change at once.
    if (this.#awaits_any()) return;
    const is_due = (garment) => made.get(garment) === 0 || (made.has(garment) && !(performance.now() < this.#told_at.get(garment) + TELL));
    for (const garment of new Set([...made.keys(), ...this.#views.keys()])) if (this.#has_moved || is_due(garment)) this.#tell(module, garment, module.take_uploads());
    this.#has_moved = false;
  }
  #tell(module, garment, uploads) {
    this.#told_at.set(garment, performance.now());
    const table = module.table(garment), at_rest = !this.#due.has(garment), {serial} = this.#views.get(garment);
    this.#post(
      {kind: 'images', garment, ...table, uploads, at_rest, serial, edition: this.#editions.get(garment)},
      [table.entries, table.tiles, ...Object.values(uploads)].map(({buffer}) => buffer));
  }
}
