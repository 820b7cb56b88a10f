// Holds a program against the conformance kit (README.md):
//
//   node run.mjs [--kit FOLDER] [--only TEXT] [--json] [--codes-only] [--display] -- COMMAND ARGUMENTS...
//
// --display asks about light from all around only, with the tolerances of display quality.
// FOLDER has the fixtures that generate.mjs made. Without it they are those beside this file, as in the
// archive that is installed, or, in a checkout, made for this run.
// Starts the command once, asks it all vectors and all checks over the query protocol, and prints a table.
// Exit 0 if every answer is right, 1 if not, 2 if the command line is wrong or the program cannot be spoken
// to.
import {spawn, spawnSync} from 'node:child_process';
import {existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {basename, dirname, join} from 'node:path';
import {createInterface} from 'node:readline';
import {fileURLToPath} from 'node:url';
import {gunzipSync} from 'node:zlib';

const beside = dirname(fileURLToPath(import.meta.url));
const SECONDS = 60;  // for one answer
/** Display quality: the most that a colour may be off, as a fraction of the brightest; and rms of the queries. */
const DISPLAY_MOST = 0.2, DISPLAY_RMS = 0.04;
const USAGE = 'node run.mjs [--kit FOLDER] [--only TEXT] [--json] [--codes-only] [--display] -- COMMAND ARGUMENTS...';

function usage(message) {
  console.error(`${message}\n${USAGE}`);
  process.exit(2);
}

function parse_arguments([...words]) {
  const options = {kit: '', only: '', json: false, codes_only: false, display: false};
  for (let word; (word = words.shift()) !== '--';) {
    if (word === '--only' && words.length > 0)
      options.only = words.shift();
    else if (word === '--kit' && words.length > 0)
      options.kit = words.shift();
    else if (word === '--json')
      options.json = true;
    else if (word === '--codes-only')
      options.codes_only = true;
    else if (word === '--display')
      options.display = true;
    else
      usage(word === undefined ? 'no command' : `unknown option ${word}`);
  }
  if (words.length === 0) usage('no command');
  return {...options, command: words};
}

/** The folder of the fixtures, which are made if they are missing. */
function kit_folder(given) {
  if (given) return given;
  if (existsSync(join(beside, 'vectors'))) return beside;
  const made = mkdtempSync(join(tmpdir(), 'conformance-kit-'));
  process.on('exit', () => rmSync(made, {recursive: true, force: true}));
  const {status} = spawnSync(process.execPath, [join(beside, 'generate.mjs'), made], {stdio: ['ignore', 'ignore', 'inherit']});
  if (status !== 0) usage('generate.mjs failed');
  return made;
}

/** A program that answers: ask(query) gives its answer. */
function start([command, ...args]) {
  const program = spawn(command, args, {stdio: ['pipe', 'pipe', 'inherit']});
  const give_up = (message) => {
    console.error(message);
    program.kill();
    process.exit(2);
  };
  program.on('error', (error) => give_up(`${command}: ${error.message}`));
  program.stdin.on('error', () => {});  // the end of the program says more
  let waiting = null;
  let last = '';
  const expect_no_end = (code, signal) =>
    give_up(`${command} ended (${signal ?? code}) instead of answering ${last}`);
  program.on('exit', expect_no_end);
  createInterface({input: program.stdout}).on('line', (line) => {
    if (!waiting) give_up(`an answer without a question: ${line}`);
    const take = waiting;
    waiting = null;
    try {
      take(JSON.parse(line));
    } catch { give_up(`not JSON: ${line}\nas the answer to ${last}`); }
  });
  const ask = (query) => new Promise((resolve) => {
    last = JSON.stringify(query);
    const timer = setTimeout(() => give_up(`no answer in ${SECONDS} s to ${last}`), SECONDS * 1000);
    waiting = (answer) => {
      clearTimeout(timer);
      resolve(answer);
    };
    program.stdin.write(last + '\n');
  });
  const stop = () => {
    program.off('exit', expect_no_end);
    program.stdin.end();
  };
  return {ask, stop};
}

/** How far a number is from the expected one, in units of its tolerance. */
function distance(given, expected, allowed) {
  if (given === expected) return 0;
  if (typeof given !== 'number') return Infinity;
  return allowed > 0 ? Math.abs(given - expected) / allowed : Infinity;
}

/** { worst, failure }: the worst error as a multiple of the tolerance; what is wrong, if anything. */
function compare(query, answer) {
  if (query.error) {
    return typeof answer.error === 'string' ? {worst: 0} : {worst: 0, failure: 'an error was due'};
  }
  if (answer.error !== undefined)
    return {worst: 0, failure: `refused: ${answer.error} ${answer.message ?? ''}`};
  if (!Array.isArray(answer.rgb) || answer.rgb.length !== 3) return {worst: Infinity, failure: 'no rgb'};
  const {relative, absolute, alpha} = query.tolerance;
  const worst = Math.max(
    distance(answer.alpha, query.alpha, alpha),
    ...query.rgb.map(
      (expected, c) => distance(answer.rgb[c], expected, relative * Math.abs(expected) + absolute)));
  if (worst <= 1) return {worst};
  return {worst, failure: `rgb ${answer.rgb} alpha ${answer.alpha} instead of rgb ${query.rgb} alpha ${query.alpha}`};
}

/** What display quality asks, with its tolerances. */
const of_display = (queries) => queries.filter(({op, error}) => op === 'environment' && !error).map((query) => ({
  ...query,
  tolerance: {relative: 0, absolute: DISPLAY_MOST * Math.max(...query.rgb), alpha: 1e-3},
}));

async function run_vectors(name, ask, display) {
  const vectors = JSON.parse(readFileSync(join(here, 'vectors', name), 'utf8'));
  const queries = display ? of_display(vectors.queries) : vectors.queries;
  const row = {kind: 'vectors', name: `vectors/${name}`, queries: queries.length, worst: 0, failures: []};
  row.squares = 0;  // sum of the squares of `worst`
  for (const query of queries) {
    const {rgb, alpha, tolerance, why, error, ...asked} = query;
    const answer = await ask({op: 'evaluate', file: join(here, vectors.file), ...asked});
    if (asked.op && answer.unsupported === true) {
      row.unsupported = true;
      continue;
    }
    const {worst, failure} = compare(query, answer);
    row.worst = Math.max(row.worst, worst);
    row.squares += worst ** 2;
    if (failure) row.failures.push({query: asked, why, failure});
  }
  return row;
}

/**
 * Whether an issue is the wanted one; the place may stand in the message, as what is not a place of a file.
 */
const fits = (issue, {code, place}, codes_only) => [code].flat().includes(issue.code) &&
  (codes_only || `${issue.place ?? ''}\n${issue.message ?? ''}`.includes(place));

/** What is wrong with the issues that a check found. */
function judge(found, expected, kind, codes_only) {
  const left = [...found];
  const failures = [];
  for (const wanted of expected.issues) {
    const i = left.findIndex((issue) => fits(issue, wanted, codes_only));
    if (i >= 0)
      left.splice(i, 1);
    else
      failures.push(`no ${[wanted.code].flat().join(' or ')} at "${wanted.place}"`);
  }
  const codes = expected.issues.flatMap(({code}) => code);
  const too_many = kind === 'warnings' ?
    left.filter(({code}) => !codes.includes(code)) :
    expected.others === 'none' ?
    left.filter(({code, severity}) => severity === 'error' && !codes.includes(code)) :
    [];
  for (const {code, place, message} of too_many) failures.push(`besides: ${code} at "${place}": ${message}`);
  if (failures.length > 0)
    failures.push(`found: ${found.map(({code, place}) => `${code} at "${place}"`).join(', ') || 'nothing'}`);
  return failures;
}

/**
 * A file that must be found good, or a fixture with its expected issues. What is kept packed is unpacked into
 * a folder of its own.
 */
async function run_check(kind, name, expected, ask, codes_only) {
  const row = {kind, name: `${kind}/${name}`, queries: 1, worst: 0, failures: []};
  const stored = join(here, kind, name);
  const folder = existsSync(`${stored}.gz`) ? mkdtempSync(join(tmpdir(), 'conformance-')) : null;
  const file = folder ? join(folder, basename(stored)) : stored;
  if (folder) writeFileSync(file, gunzipSync(readFileSync(`${stored}.gz`)));
  const answer = await ask({op: 'check', file});
  if (answer.unsupported === true)
    row.unsupported = true;
  else if (!Array.isArray(answer.issues))
    row.failures.push({failure: `no list of issues: ${JSON.stringify(answer)}`});
  else
    row.failures.push(...judge(answer.issues, expected, kind, codes_only).map((failure) => ({failure})));
  if (expected.evaluate) {
    ++row.queries;
    const {error, rgb} = await ask({op: 'evaluate', file, ...expected.evaluate});
    if (typeof error !== 'string')
      row.failures.push({query: expected.evaluate, failure: `evaluated to ${rgb}, an error was due`});
  }
  if (folder) rmSync(folder, {recursive: true});
  return row;
}

const SOUND = {issues: [], others: 'none'};

/** The garment in a folder. */
const garment_in = (folder) => readdirSync(folder).find((name) => /\.gl(tf|b)$/.test(name));

async function run_all({command, only, codes_only, display}) {
  const {ask, stop} = start(command);
  const wanted = (name) => name.includes(only);
  const rows = [];
  for (const name of readdirSync(join(here, 'vectors')).sort()) {
    if (wanted(`vectors/${name.replace(/json$/, 'exr')}`)) rows.push(await run_vectors(name, ask, display));
  }
  if (display) {
    stop();
    return rows.filter(({queries}) => queries > 0);
  }
  for (const name of readdirSync(join(here, 'valid')).sort()) {
    const file = name.endsWith('.exr') ? name : `${name}/${garment_in(join(here, 'valid', name))}`;
    if (wanted(`valid/${file}`)) rows.push(await run_check('valid', file, SOUND, ask, codes_only));
  }
  for (const kind of ['invalid', 'warnings']) {
    for (const name of readdirSync(join(here, kind)).sort()) {
      const expected = JSON.parse(readFileSync(join(here, kind, name, 'expected.json'), 'utf8'));
      const file = `${name}/${expected.file}`;
      if (wanted(`${kind}/${file}`)) rows.push(await run_check(kind, file, expected, ask, codes_only));
    }
  }
  stop();
  return rows;
}

function print_table(rows) {
  const width = Math.max(...rows.map(({name}) => name.length));
  console.log(`${'file'.padEnd(width)}  queries   worst  verdict`);
  for (const {kind, name, queries, worst, failures, unsupported} of rows) {
    const error = kind === 'vectors' ? worst.toFixed(3) : '';
    const left_out = kind === 'vectors' ? 'good in part' : 'not checked';
    const verdict = failures.length > 0 ? 'WRONG' : unsupported ? left_out : 'good';
    console.log(`${name.padEnd(width)}  ${String(queries).padStart(7)}  ${error.padStart(6)}  ${verdict}`);
    for (const {query, why, failure} of failures) {
      if (query) console.log(`    ${JSON.stringify(query)}`);
      if (why) console.log(`    ${why}`);
      console.log(`    ${failure}`);
    }
  }
}

const options = parse_arguments(process.argv.slice(2));
const here = kit_folder(options.kit);
if (!existsSync(join(here, 'vectors'))) usage(`no fixtures in ${here}: node generate.mjs makes them`);
const rows = await run_all(options);
if (rows.length === 0) usage(`nothing has "${options.only}" in its name`);
const sum = (list) => list.reduce((a, b) => a + b, 0);
const report = {
  files: rows.length,
  queries: sum(rows.map((row) => row.queries)),
  wrong: rows.filter((row) => row.failures.length > 0).length,
  unsupported: rows.filter((row) => row.unsupported).length,
  worst: Math.max(...rows.map((row) => row.worst)),
};
if (options.display) report.rms = DISPLAY_MOST * Math.sqrt(sum(rows.map((row) => row.squares)) / report.queries);
if (options.json) {
  // JSON has no infinity: a number that is not there, or where no error is allowed, counts as null.
  console.log(JSON.stringify({...report, rows}, null, 1));
} else {
  print_table(rows);
  console.log(
    `${report.files} files, ${report.queries} queries, ${report.wrong} files wrong, ${
      report.unsupported} not checked; ` +
    `worst error ${report.worst.toFixed(3)} of its tolerance`);
  if (options.display) console.log(`rms ${report.rms.toFixed(3)} of the brightest colour, ${DISPLAY_RMS} allowed`);
}
process.exitCode = report.wrong > 0 || report.rms > DISPLAY_RMS ? 1 : 0;
