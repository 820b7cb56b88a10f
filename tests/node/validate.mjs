// The Khronos validator over glTF files.
//
//   node validate.mjs FILE...                 prints one JSON object per file: counts and messages
//   node validate.mjs --compare INPUT OUTPUT  exit 1 if OUTPUT has more errors or warnings of some code than INPUT
//
// Without --compare, exit 1 if any file has errors or warnings. UNSUPPORTED_EXTENSION is ignored: the
// validator cannot know extensions of vendors; and so is that viewers make the tangents of the fallback, as glTF asks them
// to: dressing changes no geometry.
import { readFile } from 'node:fs/promises';
import { dirname, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import validator from 'gltf-validator';

const severities = ['error', 'warning', 'info', 'hint'];

export async function validate(file) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), {
    uri: file,
    maxIssues: 0,
    ignoredIssues: ['UNSUPPORTED_EXTENSION', 'MESH_PRIMITIVE_GENERATED_TANGENT_SPACE'],
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(resolve(dirname(file), decodeURIComponent(uri)))),
  });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  return { file, errors: numErrors, warnings: numWarnings, infos: numInfos, hints: numHints, messages };
}

const code = (message) => `${severities[message.severity]} ${message.code}`;

export async function compare(input, output) {
  const serious = (report) => report.messages.filter((message) => message.severity < 2);
  const old = new Map();
  for (const message of serious(await validate(input))) old.set(code(message), (old.get(code(message)) ?? 0) + 1);
  const messages = serious(await validate(output)).filter((message) => {
    const left = old.get(code(message)) ?? 0;
    old.set(code(message), left - 1);
    return left <= 0;
  });
  return { input, output, fresh: [...new Set(messages.map(code))], messages: messages.slice(0, 8) };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const files = process.argv.slice(2);
  if (files[0] === '--compare') {
    const result = await compare(files[1], files[2]);
    console.log(JSON.stringify(result));
    process.exitCode = result.fresh.length > 0 ? 1 : 0;
  } else {
    for (const file of files) {
      const report = await validate(file);
      console.log(JSON.stringify(report));
      if (report.errors > 0 || report.warnings > 0) process.exitCode = 1;
    }
  }
}
