// The WebAssembly module of cell images (cells/module.cpp, fabrics.cpp): takes fabrics of the reader and garments, gives tiles of an
// atlas. For one thread; in browsers the worker.
import {Issue, LAYERS, SIDES, TRANSFER_VALUES, layer_channels, level_of_texels, pairs_at, read_layer} from './reader/index.js';

export class CellModule {
  #of;
  /** `module`: a WebAssembly.Module. */
  constructor(module) {
    // The module has no files: libc's messages are refused (EBADF).
    const wasi = new Proxy({}, {get: () => () => 8});
    this.#of = new WebAssembly.Instance(module, {wasi_snapshot_preview1: wasi}).exports;
    this.#of._initialize();
  }
  /** Views of memory, which moves where it grows. */
  #floats = (at, count) => new Float32Array(this.#of.memory.buffer, at, count);
  #words = (at, count) => new Int32Array(this.#of.memory.buffer, at, count);
  /** Room for `count` numbers, as { floats, words }. */
  #input(count) {
    const at = this.#of.input(count);
    return {floats: this.#floats(at, count), words: this.#words(at, count)};
  }

  /** Sets the bytes of images; returns the rows of the atlas. */
  set_memory = (bytes) => this.#of.set_memory(Math.min(bytes, 2 ** 31));

  /** The number of a fabric of open_fabric. Throws an Issue where a layer is broken. */
  add_fabric(fabric) {
    const {texels, levels, mmPerRepeat, referenceHeight, thickness} = fabric, of = this.#of, {floats, words} = this.#input(7);
    words.set([...texels, levels]);
    floats.set([...mmPerRepeat, referenceHeight, thickness], 3);
    const number = of.add_fabric();
    this.#add_side(number, fabric, 0);
    const others = SIDES.filter((name) => fabric.sides[name]);
    for (const name of others) this.#add_side(number, fabric.sides[name], 1 + SIDES.indexOf(name));
    const shown = others.flatMap((name) => fabric.sides[name].shown);
    this.#input(shown.length).words.set(shown);
    const ended = of.end_fabric(number);
    if (ended === 0) throw new Issue('FABRIC_MALFORMED', 'yarns', 'is out of range');
    /** Of the fabric that came last. */
    this.has_holes = ended === 2;
    return number;
  }
  #add_side(number, fabric, side) {
    const {views, lights, layers, radianceScale = 1} = fabric;
    const {lobes, products, bases, yarns, map} = layers, counts = yarns ?? {curves: 0, nodes: 0, stations: 0, fields: 30};
    const {functions = 0, step = 0} = counts.packed ?? {}, {floats, words} = this.#input(19), grid = (of) => of ? [of.columns, of.rows] : [1, 1];
    words.set([
      side, ...grid(views), ...grid(lights), lobes?.lobes ?? 0,
      products ? Math.max(...products.pairs.map((pairs) => pairs.length)) : 0, bases?.functions.views ?? 0,
      bases?.functions.lights ?? 0, counts.curves, counts.nodes, counts.stations, counts.fields, counts.valuesPerStation ?? TRANSFER_VALUES,
      functions
    ]);
    floats.set([step], 15);
    words.set(map?.size ?? [0, 0], 16);
    floats.set([radianceScale], 18);
    this.#of.add_side(number);
    for (const [kind, layer] of LAYERS.entries()) {
      // Yarn is stored once, at the front.
      if (!layers[layer] || (side > 0 && layer === 'yarns')) continue;
      for (const k of layers[layer].levels) {
        if (level_of_texels(fabric, layer, k) !== k) continue;
        const values = read_layer(fabric, layer, k), channels = layer_channels(layer, fabric).map((name) => values.get(name));
        const pairs = layer === 'products' ? pairs_at(fabric, k).flat() : [], texels = channels[0]?.length ?? 0;
        const input = this.#input(pairs.length + texels * channels.length);
        input.words.set(pairs);
        channels.forEach((channel, i) => input.floats.set(channel, pairs.length + i * texels));
        this.#of.add_layer(number, kind, k, channels.length, pairs.length / 2);
      }
    }
  }

  /** The variation of a fabric, as its shader has it: { keys, runs, numbers }. */
  variation(number) {
    const at = this.#of.variation_of(number), words = this.#words(at, 18);
    return {keys: new Uint32Array(words.slice(0, 6)), runs: words.slice(6), numbers: this.#floats(at + 72, 16).slice()};
  }

  /** [red, green, blue, alpha] of a query of the conformance kit. */
  query(number, {level, texel, uv, behind = false, light, view}) {
    this.#input(6).floats.set([...light, ...view]);
    const at = this.#of.evaluate_query(number, behind ? 1 : 0, texel ? 1 : 0, level, ...(texel ?? uv));
    return [...this.#floats(at, 4)];
  }

  /**
   * Adds a mesh in a fabric: `vertices`, eight numbers each (position, normal, u and v), and `corners`, three of each
   * triangle. Returns { number, charts, beyond }: six numbers of each vertex, and a number of the look-up.
   */
  add_garment(fabric, vertices, corners) {
    const {floats, words} = this.#input(vertices.length + corners.length), count = vertices.length / 8;
    floats.set(vertices);
    words.set(corners, vertices.length);
    const number = this.#of.add_garment(fabric, count, corners.length / 3);
    return {number, charts: this.#floats(this.#of.charts_of(number), 6 * count).slice(), beyond: this.#of.beyond_of(number)};
  }
  /** Gives a garment another shape: position and normal of each vertex. */
  pose_garment(number, shape) {
    this.#input(shape.length).floats.set(shape);
    this.#of.pose_garment(number);
  }
  remove_garment = (number) => this.#of.remove_garment(number);

  /** Begins a frame: `numbers` are a FrameInput, `lights` LightInputs (cells/module.cpp). Returns the patches in sight. */
  begin_frame(number, numbers, lights) {
    const {floats} = this.#input(numbers.length + 10 * lights.length);
    floats.set(numbers);
    lights.forEach((light, i) => floats.set(light, numbers.length + 10 * i));
    return this.#of.begin_frame(number, lights.length);
  }
  /** Makes images of the next `count` patches. Returns how many are left. */
  make_images = (number, count) => this.#of.make_images(number, count);
  /** How far the next patch is from the middle of the picture, in halves of it; Infinity without one. */
  next_off_middle = (number) => this.#of.next_off_middle(number);
  /**
   * { first, entries, tiles, missing, wanted }: a garment's part of the table, all tiles, and of the patches in sight those
   * without an image.
   */
  table(number) {
    const [first, count, entries, tiles, numbers, missing, wanted] = this.#words(this.#of.table_of(number), 7);
    const words = (at, count) => new Uint32Array(this.#of.memory.buffer, at, count).slice();
    return {first, entries: words(entries, count), tiles: words(numbers, 4 * tiles), missing, wanted};
  }
  remove_fabric = (number) => this.#of.remove_fabric(number);
  /** Gives a fabric the content of another one, whose repeat is as large and which is then gone. */
  replace_fabric = (number, by) => this.#of.replace_fabric(number, by);
  /** Whether a frame has come to all patches in front: images before it are not shown then. */
  end_front = (number) => this.#of.end_front(number) !== 0;
  /**
   * Since the last call: whether images have found no room, so that the next frames' are coarser, and whether tiles have moved,
   * also other garments'.
   */
  take_events() {
    const events = this.#of.take_events();
    return {is_full: (events & 1) !== 0, has_moved: (events & 2) !== 0};
  }
  forget_tiles = () => this.#of.forget_tiles();
  /**
   * Tiles that are new since the last call: `places`, column, row, width and height of each, and their texels one after the
   * other, four halves and a byte each.
   */
  take_uploads() {
    const [count, places, texels, halves, heights] = this.#words(this.#of.take_uploads(), 5), {buffer} = this.#of.memory;
    return {
      places: this.#words(places, 4 * count).slice(),
      halves: new Uint16Array(buffer, halves, 4 * texels).slice(),
      heights: new Uint8Array(buffer, heights, texels).slice(),
    };
  }
}
