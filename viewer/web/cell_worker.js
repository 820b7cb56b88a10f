// The work of a page's worker: reads fabrics, and makes cell images of what is in sight, in turns. Takes and posts messages,
// objects with a `kind`:
//
//   start    { wasm, memory }: the module, as bytes or its address; bytes that images may take
//   fabric   { id, source }; posts fabric { id, result } or { id, issue }
//   garment  { id, fabric, vertices, corners }, of CellModule.add_garment(); posts garment { id, number, charts, beyond }
//   pose     { garment, shape }, of CellModule.pose_garment()
//   view     { garment, camera, level, around, lights, serial }: what is seen of a garment from now on
//   remove   { garment }
//   again    {}: the tiles are lost; the views come again, too
//
// and posts images { garment, first, entries, tiles, missing, wanted, uploads, at_rest, serial }, of CellModule.table() and
// take_uploads(), and whether all images are as the view wants them.
import {CellModule} from './cells.js';
import {issue_of, opened} from './load.js';
import {Issue} from './reader/index.js';

/** ms after which messages are taken again, and patches that images are made of without a look at the clock. */
const SLICE = 30, CHUNK = 4;
const MOVING = {samples: 2, fresh: 0.08}, RESTING = {samples: 2.5, fresh: 1};
/** ms without another view after which images are made as one that rests wants them. */
const REST = 150;

export class CellWorker {
  #post;
  #module = null;
  #fabrics = new Map();
  /** What is to be done of each garment: { view, way, left }. */
  #due = new Map();
  #working = false;
  #seen_at = 0;
  constructor(post) {
    this.#post = post;
  }

  async receive({kind, ...message}) {
    await this[kind](message);
  }
  start({wasm, memory}) {
    this.#module = (async () => {
      const bytes = typeof wasm === 'string' ? await (await fetch(wasm)).arrayBuffer() : wasm;
      const module = new CellModule(await WebAssembly.compile(bytes));
      module.set_memory(memory);
      return module;
    })().catch((error) => {
      throw new Issue('GRAPHICS_UNAVAILABLE', '', `WebAssembly: ${error.message}`);
    });
    this.#module.catch(() => {});
  }
  async fabric({id, source}) {
    try {
      const fabric = await opened(source), module = await this.#module;
      const number = module.add_fabric(fabric);
      const result = {number, levels: fabric.levels, mm_per_repeat: fabric.mmPerRepeat, has_yarn: Boolean(fabric.layers.yarns)};
      this.#post({kind: 'fabric', id, result});
    } catch (error) {
      const {code, place, message} = issue_of(error);
      this.#post({kind: 'fabric', id, issue: [code, place, message]});
    }
  }
  async garment({id, fabric, vertices, corners}) {
    const garment = (await this.#module).add_garment(fabric, vertices, corners);
    this.#post({kind: 'garment', id, ...garment}, [garment.charts.buffer]);
  }
  async pose({garment, shape}) {
    (await this.#module).pose_garment(garment, shape);
  }
  async view({garment, ...view}) {
    await this.#module;
    this.#due.set(garment, {view, way: MOVING, left: null});
    this.#seen_at = performance.now();
    this.#work();
  }
  async remove({garment}) {
    this.#due.delete(garment);
    (await this.#module).remove_garment(garment);
  }
  async again() {
    (await this.#module).forget_tiles();
  }

  async #work() {
    if (this.#working) return;
    this.#working = true;
    const module = await this.#module;
    while (this.#due.size > 0) {
      const all = [...this.#due], [garment, due] = all.find(([, {way}]) => way === MOVING) ?? all[0];
      const early = due.way === MOVING ? 0 : this.#seen_at + REST - performance.now();
      if (early > 0) {
        await new Promise((end) => setTimeout(end, early));
        continue;
      }
      this.#due.delete(garment);
      this.#make(module, garment, due);
      await new Promise((end) => setTimeout(end));
    }
    this.#working = false;
  }
  #make(module, garment, {view, way, left}) {
    const {camera, level, around, lights, serial} = view;
    left ??= module.begin_frame(garment, [...camera, way.samples, way.fresh, level, around ? 1 : 0, ...around ?? Array(36).fill(0)], lights);
    const end = performance.now() + SLICE;
    while (left > 0 && performance.now() < end) left = module.make_images(garment, CHUNK);
    const table = module.table(garment), uploads = module.take_uploads();
    const at_rest = left === 0 && way === RESTING;
    this.#post(
      {kind: 'images', garment, ...table, uploads, at_rest, serial},
      [table.entries.buffer, table.tiles.buffer, ...uploads.flatMap(({halves, heights}) => [halves.buffer, heights.buffer])]);
    if (!at_rest) this.#due.set(garment, left > 0 ? {view, way, left} : {view, way: RESTING, left: null});
  }
}
