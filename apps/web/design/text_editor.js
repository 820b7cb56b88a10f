// The chart or draft of a recipe as cells and as text. The program reads it and finds faults; they are shown where they are.
import {Color} from 'three';
import {element} from './element.js';
import {width_of, with_columns, with_letter, with_number, with_rows, with_stitch} from './text_grid.mjs';

/** More are edited as text alone. */
const CELLS = 4096;
/** ms without a key after which a text is taken. */
const REST = 500;
const SIGNS = {k: '', p: '–', yo: 'o', k2tog: '/', ssk: '\\'};
const by_id = (id) => document.getElementById(id);
const [text, grid, tools, fault] = ['text', 'grid', 'grid_tools', 'text_refusal'].map(by_id);
const one_to = (n) => Array.from({length: n}, (_, k) => k + 1), falling = (n) => one_to(n).reverse();

function grid_of(label, columns, rows) {
  const made = element('div', {className: 'cells', role: 'grid', ariaLabel: label}, ...rows.map((cells) => element('div', {role: 'row'}, ...cells)));
  made.style.gridTemplateColumns = `repeat(${columns}, var(--cell))`;
  return made;
}
/** Colours a cell or button; green is most of what eyes take for lightness. */
const paint = (made, [r, g, b]) => Object.assign(made.style, {background: `#${new Color(r, g, b).getHexString()}`, color: g > 0.15 ? '#000' : '#fff'});
function drawdown_of({ends, picks, drawdown}) {
  const drawn = element('canvas', {width: ends, height: picks, role: 'img', ariaLabel: 'Drawdown'}), pen = drawn.getContext('2d');
  drawn.style.cssText = `width: calc(${ends} * var(--cell)); height: calc(${picks} * var(--cell))`;
  [...drawdown].forEach((sign, k) => sign === '#' && pen.fillRect(k % ends, picks - 1 - Math.floor(k / ends), 1, 1));
  return drawn;
}
/** The next cell of a grid in the direction of an arrow key, if any. */
function neighbour_of(cell, right, down) {
  const place_of = ({dataset}) => dataset.at.split(',').map(Number), [x, y] = place_of(cell);
  const cells = [...cell.closest('[role=grid]').querySelectorAll('[data-at]')].map((other) => [other, ...place_of(other)]);
  const ahead = cells.filter(([, i, j]) => right ? j === y && (i - x) * right > 0 : (j - y) * down > 0);
  return ahead.sort(([, i, j], [, k, l]) => Math.abs(j - y) - Math.abs(l - y) || Math.abs(i - x) - Math.abs(k - x))[0]?.[0];
}

export class TextEditor {
  #name = null;
  #cells = null;
  #chosen = 'p';
  #rest = 0;
  #shown = null;
  #fault = '';
  /** Settled when the cells are the text's. */
  #read = Promise.resolve();
  /** Cells that a finger or the mouse is drawn over; they change together. */
  #stroke = [];

  /** change(text): takes a text of the user. list(name, text): a promise of the program's cells of it, if any. */
  constructor(change, list) {
    Object.assign(this, {change, list});
    text.addEventListener('input', () => {
      clearTimeout(this.#rest);
      this.#rest = setTimeout(() => this.#take(), REST);
    });
    text.addEventListener('change', () => this.#take());
    grid.addEventListener('pointerdown', (event) => this.#draw_over(event));
    addEventListener('pointermove', (event) => this.#stroke.length > 0 && this.#draw_over(event));
    for (const end of ['pointerup', 'pointercancel']) addEventListener(end, ({type}) => this.#end_stroke(type === 'pointerup'));
  }
  #take() {
    clearTimeout(this.#rest);
    if (text.value === this.#shown) return;
    this.change(this.#shown = text.value);
    return this.#load();
  }
  /** Lets the program read the text. Cells that it cannot read stay as they were. */
  #load() {
    const name = this.#name, written = text.value;
    const load = async () => {
      const cells = name && await this.list(name, written);
      if (name !== this.#name || written !== text.value) return;
      if (!cells || cells.rows || cells.drawdown || cells.ends * cells.picks > CELLS) this.#cells = cells;
      this.#show_grid();
    };
    return this.#read = load();
  }
  /** Changes the text by change(text, cells), one after the other; instructions become a chart. */
  async #edit(change) {
    for (let last; last !== this.#read;) await (last = this.#read);
    if (!this.#cells || this.#cells.chart === '') return;
    if (this.#cells.chart) {
      text.value = this.#cells.chart;
      await this.#load();
    }
    text.value = change(text.value, this.#cells);
    await this.#take();
  }
  async #put(cells, sign) {
    const [{dataset: {at}}] = cells, label = cells[0].closest('[role=grid]').ariaLabel;
    await this.#edit((all, now) => cells.reduce((edited, cell) => cell.edited(edited, now, sign), all));
    grid.querySelector(`[aria-label="${label}"] [data-at="${at}"]`)?.focus({preventScroll: true});
  }
  #end_stroke(puts) {
    const cells = this.#stroke.splice(0);
    cells.forEach(({classList}) => classList.remove('drawn'));
    if (puts && cells.length > 1) this.#put(cells);
  }
  #draw_over({clientX: x, clientY: y}) {
    const cell = document.elementFromPoint(x, y)?.closest('#grid [data-at]'), stroke = this.#stroke;
    if (!cell || stroke.includes(cell) || stroke[0]?.ariaPressed !== (stroke[0] && cell.ariaPressed)) return;
    stroke.push(cell);
    if (stroke.length > 1) stroke.forEach(({classList}) => classList.add('drawn'));
  }
  /** A cell at x, y of a grid; edited(text, cells, sign) is the text after its change, by one of `signs` or as chosen. */
  #cell_of(x, y, members, edited, signs = []) {
    const cell = element('button', {className: 'cell', role: 'gridcell', tabIndex: x || y ? -1 : 0, onclick: () => this.#put([cell]), ...members});
    cell.dataset.at = `${x},${y}`;
    cell.edited = edited;
    cell.addEventListener('keydown', (event) => {
      const [right, down] = {ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowDown: [0, 1], ArrowUp: [0, -1]}[event.key] ?? [0, 0];
      if (signs.includes(event.key)) this.#put([cell], event.key);
      if (!(right || down)) return;
      event.preventDefault();
      neighbour_of(cell, right, down)?.focus();
    });
    return cell;
  }
  #show_chart({rows, yarns}) {
    const used = new Set(rows.flatMap(({stitches}) => stitches.map(([stitch]) => stitch))), letters = yarns.length > 1 ? yarns.map(({name}) => name) : [];
    const offered = [...new Set(['k', 'p', 'yo', 'k2tog', 'ssk', 'c4f', 'c4b', ...used])].filter(Boolean);
    if (![...offered, ...letters].includes(this.#chosen)) this.#chosen = 'k';
    const choose = (sign) => this.#show_grid(this.#chosen = sign);
    const pick = (sign) => element('button', {textContent: sign, ariaPressed: String(sign === this.#chosen), onclick: () => choose(sign)});
    const of_yarns = letters.map(pick), changed = {row: with_rows, column: with_columns};
    of_yarns.forEach((button, k) => paint(button, yarns[k].albedo));
    const sizes = [['+↕', 'row more'], ['−↕', 'row less'], ['+↔', 'column more'], ['−↔', 'column less']].map(([textContent, words]) => {
      const title = `One ${words}`, [what, way] = words.split(' ');
      return element('button', {textContent, title, ariaLabel: title, onclick: () => this.#edit((all, cells) => changed[what](all, cells, way === 'more'))});
    });
    tools.replaceChildren(...offered.map(pick), ...of_yarns, ...sizes);
    const columns = Math.max(1, ...rows.map((row) => row.yarns.length));
    grid.replaceChildren(grid_of('Chart', columns, rows.map((row, y) => this.#cells_of(row, y, yarns, letters))));
  }
  #cells_of({number, line, stitches, yarns}, y, all_yarns, letters) {
    let end = 0;
    const cells = stitches.map(([stitch, width]) => {
      const x = end, letter = yarns[x], of_yarn = letters.length > 0 ? letter : '';
      end += width;
      const edited = (all, now, sign = this.#chosen) => (letters.includes(sign) ? with_letter : with_stitch)(all, now, y, x, sign);
      const cell = this.#cell_of(x, y, {
        textContent: SIGNS[stitch] ?? (stitch || '?'), title: `${stitch}${of_yarn && `, ${letter}`}`,
        ariaLabel: `Row ${number}, column ${x + 1}: ${stitch}${of_yarn && ` of ${letter}`}`
      }, edited, ['k', 'p', ...letters]);
      // Rows of other lengths are refused, and shown.
      cell.style.gridColumn = `${x + 1} / span ${width}`;
      if (of_yarn) paint(cell, all_yarns.find(({name}) => name === letter).albedo);
      return cell;
    });
    // A row that the program cannot read is shown as it is written.
    if (cells.length === 0) cells.push(element('div', {className: 'cell row_text', textContent: text.value.split('\n')[line - 1]}));
    for (const {dataset} of cells) dataset.place = `line ${line}`;
    return cells;
  }
  #show_draft(draft) {
    const {ends, picks, shafts, treadles, drawdown = ''} = draft, right = treadles || shafts;
    tools.replaceChildren();
    if (!drawdown || ends * shafts + right * (shafts + picks) > CELLS)
      return grid.replaceChildren(element('small', {textContent: `${ends} x ${picks} yarns are edited as text.`}));
    const sets = (section, label, columns, keys, numbers, is_flat, alone) => grid_of(label, columns, numbers.map((number, y) => keys.map((key, x) => {
      // Lists by columns (threading, tie-up) and by rows (treadling, lift plan).
      const [entry, value] = is_flat ? [key, number] : [number, key], is_set = draft[section][entry - 1].includes(value);
      const cell = this.#cell_of(x, y, {ariaPressed: String(is_set), ariaLabel: `${label} ${entry}: ${value}`},
        (all, now) => with_number(all, now, section, entry, value, alone));
      cell.dataset.place = `[${section.toUpperCase()}] ${entry}`;
      return cell;
    })));
    grid.replaceChildren(element('div', {className: 'draft'},
      sets('threading', 'Threading', ends, one_to(ends), falling(shafts), true, true),
      treadles ? sets('tieup', 'Tie-up', treadles, one_to(treadles), falling(shafts), true, false) : element('div'),
      drawdown_of(draft),
      sets(treadles ? 'treadling' : 'liftplan', treadles ? 'Treadling' : 'Lift plan', right, one_to(right), falling(picks), false, treadles > 0)));
  }
  #show_grid() {
    const cells = this.#cells, count = cells?.rows?.reduce((sum, {yarns}) => sum + yarns.length, 0);
    if (!cells || count > CELLS) grid.replaceChildren(...count > CELLS ? [`${count} stitches are edited as text.`] : []), tools.replaceChildren();
    else if (cells.rows) this.#show_chart(cells);
    else this.#show_draft(cells);
    this.#mark();
  }
  /** Marks the line or the cells of the fault. */
  #mark() {
    const [place] = this.#fault.match(/^(?:\[[A-Z ]+\](?: [\w ]+)?|line \d+)(?=:)/i) ?? [''], name = place.startsWith('[') ? place.toUpperCase() : place, {lines = {}} = this.#cells ?? {};
    for (const cell of grid.querySelectorAll('.cell')) cell.classList.toggle('wrong', name !== '' && cell.dataset.place === name);
    const line = lines[name] ?? lines[name.match(/^.*\]/)?.[0]] ?? Number(name.match(/^line (\d+)/)?.[1] ?? 0);
    // Seen, and not in the way of the keys.
    if (line > 0 && document.activeElement !== text) text.scrollTop = (line - 1) * text.scrollHeight / text.value.split('\n').length - text.clientHeight / 2;
  }
  /** Shows a refusal where it belongs: the line that it names, or the section and key of a draft; whether it is of the text. */
  refuse(line) {
    const is_own = this.#name !== null && line !== '' && !/--set/.test(line);
    this.#fault = is_own ? line.replace(`${this.#name}: `, '') : '';
    text.ariaInvalid = String(is_own);
    fault.textContent = this.#fault;
    this.#mark();
    return is_own;
  }
  show({text: written, stitch}) {
    by_id('editor').hidden = written === undefined;
    const is_other = this.#name !== (this.#name = written === undefined ? null : stitch);
    if (this.#name === null || (!is_other && this.#shown === written)) return;
    clearTimeout(this.#rest);
    if (text.value !== written) text.value = written;
    this.#shown = written;
    if (is_other) this.#cells = null, grid.replaceChildren();
    this.#load();
  }
}
