// The chart or draft of a recipe as cells and as text. The module of make finds faults; they are shown where they are.
import {STITCHES, read_chart, width_of, with_columns, with_letter, with_rows, with_stitch} from './chart_grid.mjs';
import {read_draft, sections_of, with_number} from './draft_grid.mjs';
import {element} from './element.js';

/** Larger ones are edited as text alone. */
const CELLS = 4096, SIDE = 128;
/** ms without a key after which a text is taken. */
const REST = 500;
const SIGNS = {k: '', p: '–', yo: '○', k2tog: '⟋', ssk: '⟍'};
const by_id = (id) => document.getElementById(id);
const [text, grid, tools, fault] = ['text', 'grid', 'grid_tools', 'text_refusal'].map(by_id);
const one_to = (n) => Array.from({length: n}, (_, k) => k + 1), falling = (n) => one_to(n).reverse();

function grid_of(label, columns, rows) {
  const made = element('div', {className: 'cells', role: 'grid', ariaLabel: label}, ...rows.map((cells) => element('div', {role: 'row'}, ...cells)));
  made.style.gridTemplateColumns = `repeat(${columns}, var(--cell))`;
  return made;
}
/** Colours a cell or button; green is most of what eyes take for lightness. */
const paint = (made, colour) => colour && Object.assign(made.style, {background: colour, color: parseInt(colour.slice(3, 5), 16) > 110 ? '#000' : '#fff'});
function drawdown_of({ends, picks, over}) {
  const drawdown = element('canvas', {width: ends, height: picks, role: 'img', ariaLabel: 'Drawdown'}), pen = drawdown.getContext('2d');
  drawdown.style.cssText = `width: calc(${ends} * var(--cell)); height: calc(${picks} * var(--cell))`;
  for (const pick of one_to(picks)) {
    for (const end of one_to(ends)) {
      pen.fillStyle = over(end, pick) ? '#223' : '#eee';
      pen.fillRect(end - 1, picks - pick, 1, 1);
    }
  }
  return drawdown;
}
/** The next cell of a grid in the direction of an arrow key, if any. */
function neighbour_of(cell, right, down) {
  const place_of = ({dataset}) => dataset.at.split(',').map(Number), [x, y] = place_of(cell);
  const cells = [...cell.closest('[role=grid]').querySelectorAll('.cell')].map((other) => [other, ...place_of(other)]);
  const ahead = cells.filter(([, i, j]) => right ? j === y && (i - x) * right > 0 : (j - y) * down > 0);
  return ahead.sort(([, i, j], [, k, l]) => Math.abs(j - y) - Math.abs(l - y) || Math.abs(i - x) - Math.abs(k - x))[0]?.[0];
}

export class TextEditor {
  #name = null;
  #chosen = 'p';
  #rest = 0;
  #shown = null;
  /** Cells that a finger or the mouse is drawn over; they change together. */
  #stroke = [];

  /** change(text): takes a text of the user. */
  constructor(change) {
    this.change = change;
    text.addEventListener('input', () => {
      clearTimeout(this.#rest);
      this.#rest = setTimeout(() => this.#take(), REST);
    });
    text.addEventListener('change', () => this.#take());
    grid.addEventListener('pointerdown', (event) => this.#draw_over(event));
    addEventListener('pointermove', (event) => this.#stroke.length > 0 && this.#draw_over(event));
    for (const end of ['pointerup', 'pointercancel']) {
      addEventListener(end, ({type}) => {
        const cells = this.#stroke.splice(0);
        cells.forEach(({classList}) => classList.remove('drawn'));
        if (type === 'pointerup' && cells.length > 1) this.#put(cells);
      });
    }
  }
  #take() {
    clearTimeout(this.#rest);
    if (text.value === this.#shown) return;
    this.change(this.#shown = text.value);
    this.#show_grid();
  }
  #edit(edited) {
    if (edited === text.value) return;
    text.value = edited;
    this.#take();
  }
  #put(cells, sign) {
    const [{dataset: {at}}] = cells, label = cells[0].closest('[role=grid]').ariaLabel;
    this.#edit(cells.reduce((all, cell) => cell.edited(all, sign), text.value));
    grid.querySelector(`[aria-label="${label}"] [data-at="${at}"]`)?.focus();
  }
  #draw_over({clientX: x, clientY: y}) {
    const cell = document.elementFromPoint(x, y)?.closest('#grid .cell'), stroke = this.#stroke;
    if (!cell || stroke.includes(cell) || stroke[0]?.ariaPressed !== (stroke[0] && cell.ariaPressed)) return;
    stroke.push(cell);
    if (stroke.length > 1) stroke.forEach(({classList}) => classList.add('drawn'));
  }
  /** A cell at x, y of a grid; edited(text, sign) is the text after its change, by one of `signs` or as chosen. */
  #cell_of(x, y, members, edited, signs = []) {
    const cell = element('button', {className: 'cell', role: 'gridcell', tabIndex: x + y === 0 ? 0 : -1, onclick: () => this.#put([cell]), ...members});
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
  #show_chart() {
    const chart = read_chart(text.value), {rows, yarns} = chart;
    const used = new Set(rows.flatMap(({stitches}) => stitches)), letters = yarns.length > 1 ? yarns.map(([letter]) => letter) : [];
    const offered = STITCHES.filter((stitch) => used.has(stitch) || ['k', 'p', 'yo', 'k2tog', 'c4f', 'c4b'].includes(stitch));
    if (![...offered, ...letters].includes(this.#chosen)) this.#chosen = 'k';
    const pick = (sign) => element('button', {
      textContent: sign, ariaPressed: String(sign === this.#chosen), onclick: () => {
        this.#chosen = sign;
        this.#show_grid();
      }
    });
    const of_yarns = letters.map(pick), changed = {row: with_rows, column: with_columns};
    of_yarns.forEach((button, k) => paint(button, yarns[k][1]));
    const sizes = [['+↕', 'row', 'more'], ['−↕', 'row', 'less'], ['+↔', 'column', 'more'], ['−↔', 'column', 'less']].map(([label, what, way]) => {
      const title = `One ${what} ${way}`, onclick = () => this.#edit(changed[what](text.value, chart, way === 'more'));
      return element('button', {textContent: label, title, ariaLabel: title, onclick});
    });
    tools.replaceChildren(...offered.map(pick), ...of_yarns, ...sizes);
    const columns = Math.max(1, ...rows.map(({stitches}) => stitches.reduce((sum, stitch) => sum + width_of(stitch), 0)));
    grid.replaceChildren(grid_of('Chart', columns, rows.map((row, y) => this.#cells_of(row, y, yarns, letters))));
  }
  #cells_of(row, y, yarns, letters) {
    const colours = new Map(yarns);
    let end = 0;
    return row.stitches.map((stitch) => {
      const x = end, width = width_of(stitch), letter = row.letters[x] ?? yarns[0][0];
      end += width;
      const edited = (all, sign = this.#chosen) => {
        const now = read_chart(all).rows[y];
        return letters.includes(sign) ? with_letter(all, now, x, sign, yarns[0][0]) : with_stitch(all, now, x, sign);
      };
      const cell = this.#cell_of(x, y, {
        textContent: SIGNS[stitch] ?? stitch, title: `${stitch}${letters.length > 0 ? `, ${letter}` : ''}`,
        ariaLabel: `Row ${row.number}, column ${x + 1}: ${stitch}${letters.length > 0 ? ` of ${letter}` : ''}`
      }, edited, ['k', 'p', ...letters]);
      Object.assign(cell.dataset, {line: row.line, word: stitch});
      // Rows of other lengths are refused, and shown.
      cell.style.gridColumn = `${x + 1} / span ${width}`;
      paint(cell, letters.length > 0 && colours.get(letter));
      return cell;
    });
  }
  #show_draft() {
    const draft = read_draft(text.value);
    tools.replaceChildren();
    if (!draft) return grid.replaceChildren();
    const {ends, picks, shafts, treadles, lifts} = draft, right = lifts ? shafts : treadles;
    if (Math.max(ends, picks, shafts, right) > SIDE || ends * shafts + right * (shafts + picks) > CELLS)
      return grid.replaceChildren(element('small', {textContent: `${ends} x ${picks} yarns are edited as text.`}));
    const sets = (section, label, columns, keys, numbers, is_flat, alone) => grid_of(label, columns, numbers.map((number, y) => keys.map((key, x) => {
      // Lists by columns (threading, tie-up) and by rows (treadling, lift plan).
      const [entry, value] = is_flat ? [key, number] : [number, key], is_set = draft.sets(section, entry).includes(value);
      const cell = this.#cell_of(x, y, {ariaPressed: String(is_set), ariaLabel: `${label} ${entry}: ${value}`},
        (all) => with_number(all, section, entry, value, alone));
      cell.dataset.word = `${section} ${entry}`;
      return cell;
    })));
    grid.replaceChildren(element('div', {className: 'draft'},
      sets('THREADING', 'Threading', ends, one_to(ends), falling(shafts), true, true),
      lifts ? element('div') : sets('TIEUP', 'Tie-up', treadles, one_to(treadles), falling(shafts), true, false),
      drawdown_of(draft),
      sets(lifts ? 'LIFTPLAN' : 'TREADLING', lifts ? 'Lift plan' : 'Treadling', right, one_to(right), falling(picks), false, !lifts)));
  }
  #show_grid() {
    if (this.#name.endsWith('.txt')) this.#show_chart();
    else if (this.#name.endsWith('.wif')) this.#show_draft();
    else grid.replaceChildren(), tools.replaceChildren();
  }
  /** Shows a refusal where it belongs: the line that it names, or the section and key of a draft; whether it is of the text. */
  refuse(line) {
    fault.textContent = '';
    for (const cell of grid.querySelectorAll('.wrong')) cell.classList.remove('wrong');
    text.removeAttribute('aria-invalid');
    if (this.#name === null || /--set/.test(line) || line === '') return false;
    const [, section, key] = line.match(/: \[([A-Z ]+)\] ?([\w ]*):/) ?? [], place = sections_of(text.value).get(section);
    const entry = place?.entries.get(key?.toUpperCase());
    const number = Number(line.match(/: line (\d+)/)?.[1] ?? NaN) - 1, found = entry?.line ?? place?.begin ?? number;
    const word = line.match(/there is no (?:stitch "(\w+)|yarn)/)?.[1], cells = [...grid.querySelectorAll('.cell')];
    const of_row = cells.filter(({dataset}) => dataset.line === String(found) || (section && dataset.word === `${section} ${key}`));
    const named = of_row.filter(({dataset}) => dataset.word === word);
    for (const cell of named.length > 0 ? named : of_row) cell.classList.add('wrong');
    text.ariaInvalid = 'true';
    fault.textContent = line.replace(`${this.#name}: `, '');
    // Seen, and not in the way of the keys.
    if (found >= 0 && document.activeElement !== text) text.scrollTop = found * text.scrollHeight / text.value.split('\n').length - text.clientHeight / 2;
    return true;
  }
  show({text: written, stitch}) {
    by_id('editor').hidden = written === undefined;
    this.#name = written === undefined ? null : stitch;
    if (this.#name === null || this.#shown === written) return;
    clearTimeout(this.#rest);
    if (text.value !== written) text.value = written;
    this.#shown = written;
    this.#show_grid();
  }
}
